"""What it costs to verify a motion is measured and told; no figure is judged here."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "benchmarks" / "bench_coverage.py"


def run(*arguments: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, str(SCRIPT), *arguments], capture_output=True, text=True, timeout=300
    )


@pytest.mark.slow
def test_every_motion_is_verified_in_both_ways_and_timed(tmp_path: Path) -> None:
    done = run("--rounds", "1", "--stride", "40", "--json", "--out", str(tmp_path))
    assert done.returncode == 0, done.stderr
    rows = json.loads(done.stdout)["rows"]
    assert [row["post"] for row in rows] == ["exact", "qp"] * 2
    assert all(row["pairs"] == 70 and row["seconds"] > 0.0 and 0.0 < row["coverage"] <= 1.0 for row in rows)
    assert "All failures of a motion" in (tmp_path / "bench_coverage.md").read_text()


def test_no_round_is_refused_in_one_sentence() -> None:
    done = run("--rounds", "0")
    assert done.returncode == 2 and "expected at least 1" in done.stderr
