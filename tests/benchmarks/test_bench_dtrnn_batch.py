"""The batch benchmark of the network solves what it times."""

import json
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[2] / "benchmarks" / "bench_dtrnn_batch.py"


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(SCRIPT), *arguments], capture_output=True, text=True, timeout=300, check=False
    )


def test_every_qp_that_is_timed_is_solved_and_told(tmp_path: Path) -> None:
    ended = run("--quick", "--json", "--out", str(tmp_path))
    assert ended.returncode == 0, ended.stderr
    rows = json.loads(ended.stdout)["rows"]
    assert {row["kind"] for row in rows} == {"panda", "random"}
    for row in rows:
        assert row["solved"] == row["count"]
        assert row["largest_row_residual"] < 1e-8
        assert row["qps_per_second_and_thread"] > 0.0
    assert max(row["bounds_active_mean"] for row in rows) > 0.5
    written = sorted(path.suffix for path in tmp_path.iterdir())
    assert written == [".json", ".md", ".png"]


def test_no_thread_is_refused_in_one_sentence() -> None:
    ended = run("--threads", "0")
    assert ended.returncode == 2 and "--threads" in ended.stderr
