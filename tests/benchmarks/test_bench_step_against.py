"""The step against that of another commit: every case has a ratio, a wrong commit is one sentence."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "benchmarks" / "bench_step_against.py"


def run(*arguments: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run([sys.executable, str(SCRIPT), *arguments], capture_output=True, text=True, cwd=ROOT)


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="needs the repository's history")
def test_every_case_has_a_ratio_against_this_very_commit() -> None:
    done = run("--against", "HEAD", "--runs", "1", "--steps", "50", "--json")
    assert done.returncode == 0, done.stderr
    figures = json.loads(done.stdout)["p50_us"]
    assert set(figures) == {
        f"{robot} {level} {way}"
        for robot in ("panda", "chain30")
        for level in ("velocity", "acceleration")
        for way in ("best", "readme", "paced")
    }
    assert all(figure["then"] > 0.0 and figure["ratio"] > 0.0 for figure in figures.values())


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="needs the repository's history")
def test_one_way_alone_can_be_compared() -> None:
    done = run("--against", "HEAD", "--runs", "1", "--steps", "20", "--ways", "paced", "--json")
    assert done.returncode == 0, done.stderr
    figures = json.loads(done.stdout)["p50_us"]
    assert len(figures) == 4 and all(name.endswith(" paced") for name in figures)


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="needs the repository's history")
def test_what_is_no_commit_is_one_sentence() -> None:
    done = run("--against", "no-such-commit")
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.startswith("'no-such-commit' is no commit of this repository")
