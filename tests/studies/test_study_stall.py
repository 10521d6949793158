"""The study of the stall escape: who gets out of the trap, and who was never in it."""

import json
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "studies" / "study_stall.py"


def test_the_escape_frees_an_exactly_stretched_arm_and_costs_nothing_elsewhere(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--quick", "--json", "--out", str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert len(result["rows"]) == 8 and result["limitations"]
    for row in result["rows"]:
        assert row["with"]["status"] == "DONE" and row["with"]["time"] < 2.5
        if row["offset"] == 0.0:
            assert row["without"]["status"] == "SCALED" and row["without"]["progress"] < 0.01
        else:
            assert row["without"]["status"] == "DONE"
            assert row["with"]["time"] < row["without"]["time"] + 0.2
    assert {run["status"] for run in result["blocked"]} == {"DONE", "BLOCKED"}
    calm = [run for run in result["blocked"] if run["calm"] and run["status"] == "BLOCKED"]
    assert max(run["verdict"] for run in calm) < 1.0 and max(run["at_limit"] for run in calm) < 0.3
    text = (tmp_path / "study_stall-quick.md").read_text(encoding="utf-8")
    assert "## Limitations" in text and "## Versions" in text
