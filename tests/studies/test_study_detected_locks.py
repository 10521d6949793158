"""Locks that nobody announces are run in physics, three times each; no figure is judged here."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "studies" / "study_detected_locks.py"


def run(*arguments: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, str(SCRIPT), *arguments], capture_output=True, text=True, timeout=300
    )


@pytest.mark.slow
def test_each_lock_is_run_told_found_out_and_never_told(tmp_path: Path) -> None:
    first = run("--cases", "2", "--json", "--keep", str(tmp_path))
    assert first.returncode == 0, first.stderr
    assert json.loads(first.stdout)["cases"] == 2
    done = run("--cases", "3", "--json", "--keep", str(tmp_path), "--out", str(tmp_path))
    result = json.loads(done.stdout)
    assert result["cases"] == 3
    assert sum(row["cases"] for row in result["drives"]) == 6  # each drive, and all
    assert "Locks that end well" in (tmp_path / "study_detected_locks.md").read_text()


def test_no_case_is_refused_in_one_sentence() -> None:
    done = run("--cases", "0")
    assert done.returncode == 2 and "expected at least 1" in done.stderr
