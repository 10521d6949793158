"""The comparison on QPs that no planner poses: the active set is right about all of them."""

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_active_set_is_right_about_every_qp_of_the_comparison(tmp_path: Path) -> None:
    script = str(ROOT / "solvers" / "compare_semidefinite.py")
    done = subprocess.run(
        [sys.executable, script, "--quick", "--json", "--out", str(tmp_path)],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    rows = [row for row in json.loads(done.stdout)["rows"] if row["backend"] == "active_set"]
    assert len(rows) == 6 and all(row["right"] == row["of"] > 0 for row in rows)
    assert (tmp_path / "compare_semidefinite-quick.md").is_file()
