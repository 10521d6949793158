"""The study of the network counts what it says, and what is known of the methods shows in its figures."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from comparison.dtrnn_study import (
    METHODS,
)
from comparison.dtrnn_study_report import EXPECTED, OBJECTIVES

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "solvers" / "study_dtrnn.py"
WITHIN = 0.2
"""How far iterations may be from the expected ones, as a share."""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """The object printed by a quick run, and the folder of its results."""
    out = tmp_path_factory.mktemp("study")
    done = _script("--quick", "--json", "--out", str(out))
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), out


def _script(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SCRIPT), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=400, check=False)


def _cells(result: dict[str, Any], part: str, **wanted: Any) -> list[dict[str, Any]]:
    return [c for c in result["cells"] if c["part"] == part and all(c[k] == v for k, v in wanted.items())]


def _one(result: dict[str, Any], part: str, **wanted: Any) -> dict[str, Any]:
    (cell,) = _cells(result, part, **wanted)
    return cell


@pytest.mark.parametrize(("method", "start"), list(EXPECTED))
@pytest.mark.parametrize("objective", ["RMP", "DLSM"])
def test_iterations_on_the_square_are_those_of_the_spec(
    run: tuple[dict[str, Any], Path], method: str, start: str, objective: str
) -> None:
    cell = _one(run[0], "square", method=method, start=start, objective=objective)
    expected = EXPECTED[method, start][OBJECTIVES.index(objective)]
    assert isinstance(expected, tuple)
    assert cell["median"] == pytest.approx(expected[0], rel=WITHIN)
    assert cell["max"] == pytest.approx(expected[2], rel=WITHIN)
    assert cell["capped"] == 0


def test_every_variant_is_right_about_infeasibility(run: tuple[dict[str, Any], Path]) -> None:
    found = _cells(run[0], "recorded")
    assert {cell["method"] for cell in found} >= set(METHODS)
    assert sum(cell["infeasible"] for cell in found) > 0
    for cell in found:
        assert cell["false_alarms"] == cell["called_solved"] == 0
        assert cell["found"] == cell["infeasible"]
        assert cell["solvable"] + cell["infeasible"] == cell["count"]


def test_results_are_written_as_json_and_markdown(run: tuple[dict[str, Any], Path]) -> None:
    result, out = run
    stem = "study_dtrnn-quick"
    assert json.loads((out / f"{stem}.json").read_text()).items() >= result.items()
    assert result["command"] == "python solvers/study_dtrnn.py --quick --json"
    assert {"cpu", "cores", "system"} <= set(result["machine"])
    assert {"ftqp", "numpy", "numba"} <= set(result["versions"])
    assert set(result["contenders"]) == set(METHODS)
    text = (out / f"{stem}.md").read_text()
    for section in (
        "## Iterations on the square",
        "## Certificates",
        "## Settings",
        "## Limitations",
        "## Versions",
    ):
        assert section in text
