"""Times are taken in turns, set-up apart, and the script says them; no figure of it is judged here."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "solvers" / "compare_speed.py"
BACKENDS = ["active_set", "daqp-fast", "proxqp-fast", "qpsolvers:daqp"]
SEQUENCES = ["panda-healthy", "panda-infeasible"]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """The object printed by a quick run of some contenders, and the folder of its results."""
    out = tmp_path_factory.mktemp("speed")
    done = _script(
        "--quick", "--json", "--backends", ",".join(BACKENDS), "--sequences", ",".join(SEQUENCES),
        "--out", str(out), "--name", "mine",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), out


def _script(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SCRIPT), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


def test_every_contender_is_timed_on_every_sequence_cold_and_warm(run: tuple[dict[str, Any], Path]) -> None:
    result, _ = run
    found = {(cell["contender"], cell["sequence"], cell["start"]) for cell in result["cells"]}
    assert found == {(a, b, c) for a in ("empty", *BACKENDS) for b in SEQUENCES for c in ("cold", "warm")}
    for cell in result["cells"]:
        assert 0.0 < cell["p50"] <= cell["worst"]
        assert cell["setup"] > 0.0
        assert cell["samples"] >= 1


def test_results_are_written_as_json_and_markdown(run: tuple[dict[str, Any], Path]) -> None:
    result, out = run
    assert json.loads((out / "compare_speed-mine.json").read_text()) == result
    text = (out / "compare_speed-mine.md").read_text()
    for part in (
        "## One solve [us]",
        "## panda-infeasible",
        "## Limitations",
        "## Settings",
        result["command"],
    ):
        assert part in text
