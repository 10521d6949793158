"""Memory is measured stage by stage in new processes; no figure is judged here."""

import json
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[2] / "benchmarks" / "bench_memory.py"


def run(*arguments: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, str(SCRIPT), *arguments], capture_output=True, text=True, timeout=300
    )


def test_every_stage_of_both_levels_is_measured_and_told(tmp_path: Path) -> None:
    done = run("--runs", "1", "--json", "--out", str(tmp_path))
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert [row["level"] for row in result["rows"]] == ["velocity", "acceleration"]
    for row in result["rows"]:
        assert list(row["added"]) == ["start", "import", "robot", "first", "further"]
        assert row["added"]["start"] > 0.0 and row["added"]["robot"] > 0.0
        so_far = sum(row["added"][stage] for stage in ("start", "import", "robot", "first"))
        assert abs(so_far - row["one_planner"]) < 0.01
    assert json.loads((tmp_path / "bench_memory.json").read_text()) == result
    assert "a further planner" in (tmp_path / "bench_memory.md").read_text()


def test_no_run_is_refused_in_one_sentence() -> None:
    done = run("--runs", "0")
    assert done.returncode == 2 and "expected at least 1" in done.stderr
