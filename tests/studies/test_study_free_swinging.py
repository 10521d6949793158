"""The study of free-swinging joints: its report, and that the planner catches what braking lets fall."""

import json
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "studies" / "study_free_swinging.py"


def test_a_falling_elbow_is_caught_and_the_report_has_its_table(tmp_path: Path) -> None:
    choices = ["--quick", "--robots", "panda", "--joints", "4", "--json", "--out", str(tmp_path)]
    done = subprocess.run(
        [sys.executable, str(SCRIPT), *choices], capture_output=True, text=True, check=False, timeout=600
    )
    assert done.returncode == 0, done.stderr
    rows = json.loads(done.stdout)["rows"]
    assert len(rows) == 2
    for row in rows:
        assert row["overspeed"] <= 1.02 and row["torque"] <= 1.0 + 1e-6
        assert row["hit"] < 0.7 * row["hit_braking"]
    text = (tmp_path / "study_free_swinging-quick.md").read_text(encoding="utf-8")
    assert "| panda | 4 | 0 | 100 | " in text and "## Limitations" in text
