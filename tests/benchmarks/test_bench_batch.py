"""The batch benchmark runs and reports; its speed is no test."""

import json
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "bench_batch.py"


def test_every_row_is_measured_and_healthy_arms_keep_to_the_path():
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--arms", "2", "--ticks", "800", "--json"],
        capture_output=True,
        text=True,
        check=True,
    )
    rows = json.loads(done.stdout)["rows"]
    assert [(row["level"], row["fault"]) for row in rows] == [
        ("velocity", False), ("velocity", True), ("acceleration", False), ("acceleration", True),
    ]  # fmt: skip
    assert all(row["steps_per_second"] > 0.0 for row in rows)
    assert all(row["max_position_error"] < 1e-4 for row in rows if not row["fault"])
