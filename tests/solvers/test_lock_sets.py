"""The study of lock sets, a tenth of it: nearly all complete, and none far off the line."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "solvers" / "lock_sets.py"
INCH = 0.0254


@pytest.mark.slow
def test_locked_joints_do_not_keep_the_arm_from_its_line():
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--quick", "--setting", "default", "--json"],
        capture_output=True,
        text=True,
        check=True,
    )
    tables = json.loads(done.stdout)["tables"]
    assert [table["start"] for table in tables] == ["N", "R"]
    for table in tables:
        assert table["complete"] >= 32 and table["sets"] == 34
        assert table["complete"] + table["blocked"] == table["sets"]
        assert table["worst_off_path"] < 0.55 * INCH
        assert table["fastest"] <= 1.0 + 1e-9
