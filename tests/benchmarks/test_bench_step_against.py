"""The step against that of another commit: every case has a ratio, a wrong commit is one sentence."""

import json
from itertools import product

import pytest
from tests.scripts import ROOT, ran, told

SCRIPT = "benchmarks/bench_step_against.py"
pytestmark = pytest.mark.skipif(not (ROOT / ".git").exists(), reason="needs the repository's history")


def test_every_case_has_a_ratio_against_this_very_commit() -> None:
    figures = json.loads(told(SCRIPT, "--against", "HEAD", "--runs", 1, "--steps", 50, "--json"))["p50_us"]
    every = product(("panda", "chain30"), ("velocity", "acceleration"), ("best", "readme", "paced"))
    assert set(figures) == {" ".join(case) for case in every}
    assert all(figure["then"] > 0.0 and figure["ratio"] > 0.0 for figure in figures.values())


def test_what_is_no_commit_is_one_sentence() -> None:
    done = ran(SCRIPT, "--against", "no-such-commit")
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.startswith("'no-such-commit' is no commit of this repository")
