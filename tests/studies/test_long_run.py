import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "studies" / "long_run.py"


def run(*arguments: object) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, str(SCRIPT), *map(str, arguments)], capture_output=True, text=True, check=False
    )


@pytest.mark.slow
def test_a_short_day_is_told_part_by_part(tmp_path: Path) -> None:
    ran = run("--hours", 0.01, "--cases", "spinning,circle", "--jobs", 2, "--out", tmp_path, "--json")
    assert ran.returncode == 0, ran.stderr
    spinning, circle = json.loads(ran.stdout)["cases"]
    for case, laps in ((spinning, 48 * 40.0), (circle, 48 * 20.0)):
        assert case["summary"]["completed"] and case["simulated"] == laps
        assert max(part["time_error"] for part in case["parts"]) < 1e-12
        assert all(part["statuses"].keys() == {"OK"} for part in case["parts"])
    assert spinning["parts"][-1]["turns"] >= 46
    assert sum(part["rows"] for part in spinning["parts"]) == spinning["summary"]["steps"]
    assert "turns" in (tmp_path / "long_run-quick.md").read_text()


@pytest.mark.parametrize(
    ("arguments", "said"), [(["--hours", "0"], "--hours is 0"), (["--cases", "x"], "--cases has 'x'")]
)
def test_bad_input_is_said_in_a_sentence(arguments: list[str], said: str) -> None:
    ran = run(*arguments)
    assert ran.returncode == 2 and said in ran.stderr and "Traceback" not in ran.stderr
