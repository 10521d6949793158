import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "studies" / "kill_runs.py"


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_killed_runs_and_campaigns_leave_files_that_are_whole(tmp_path: Path) -> None:
    ran = subprocess.run(
        [sys.executable, str(SCRIPT), "--runs", "60", "--campaigns", "4", "--out", str(tmp_path), "--json"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ran.returncode in (0, 1), ran.stderr
    found = json.loads(ran.stdout)
    assert {way: facts["damaged"] for way, facts in found["runs"].items()} == {
        way: [] for way in found["runs"]
    }
    assert sum(facts["kills"] for facts in found["runs"].values()) > 50
    assert sum(facts["rows"] for facts in found["runs"].values()) > 0
    assert found["studies"]["damaged"] == [] and found["studies"]["kills"] > 0
    assert "Killed runs" in (tmp_path / "kill_runs-quick.md").read_text()
