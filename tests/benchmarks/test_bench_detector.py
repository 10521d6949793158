"""What a detector costs is measured beside the same planner without one; no figure is judged here."""

import json
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[2] / "benchmarks" / "bench_detector.py"


def run(*arguments: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, str(SCRIPT), *arguments], capture_output=True, text=True, timeout=300
    )


def test_steps_with_and_without_a_detector_are_timed_and_told(tmp_path: Path) -> None:
    done = run("--rounds", "1", "--json", "--out", str(tmp_path))
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert len(result["rows"]) == 3
    for row in result["rows"]:
        assert row["added"] == row["p50"][1] - row["p50"][0]
        assert min(row["p50"]) > 0.0 and row["p99"][0] >= row["p50"][0]
    assert "A step with and without a detector" in (tmp_path / "bench_detector.md").read_text()


def test_no_round_is_refused_in_one_sentence() -> None:
    done = run("--rounds", "0")
    assert done.returncode == 2 and "expected at least 1" in done.stderr
