"""The study of lock sets, a tenth of it: nearly all complete, and none far off the line."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "studies" / "lock_sets.py"
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
        # Calm gives up two sets more than an arm without it, which swings at its limits to find a way on:
        # j2 and j11 from both starts, j3, j5 and j11 from R (docs/theory/path-progress.md, "Stalls").
        assert table["complete"] >= 30 and table["sets"] == 34
        assert table["complete"] + table["blocked"] == table["sets"]
        assert table["worst_off_path"] < 0.15 * INCH
        assert table["fastest"] <= 1.0 + 1e-9
