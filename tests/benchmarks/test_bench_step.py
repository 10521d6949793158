"""The step benchmark runs and says what it promises; no figure of it is judged here."""

import json
from itertools import product
from pathlib import Path
from typing import Any

import pytest
from tests.scripts import ROOT, told

OURS = "ftqp active_set"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """The object printed by a quick run without peers, and the folder of its results."""
    out = tmp_path_factory.mktemp("bench")
    return json.loads(told("benchmarks/bench_step.py", "--quick", "--json", "--out", out)), out


def test_what_is_timed_follows_the_target_and_holds_the_joint(run) -> None:
    result, _ = run
    for case in result["cases"]:
        row = case["variants"][OURS]
        assert row["position_error"] < 5e-3
        assert row["locked_joint_motion"] == 0.0
        assert set(row["statuses"]) == {"OK"}


SCRIPT = "benchmarks/bench_step_against.py"
with_history = pytest.mark.skipif(not (ROOT / ".git").exists(), reason="needs the repository's history")


@with_history
def test_every_case_has_a_ratio_against_this_very_commit() -> None:
    figures = json.loads(told(SCRIPT, "--against", "HEAD", "--runs", 1, "--steps", 50, "--json"))["p50_us"]
    every = product(("panda", "chain30"), ("velocity", "acceleration"), ("best", "readme", "paced"))
    assert set(figures) == {" ".join(case) for case in every}
    assert all(figure["then"] > 0.0 and figure["ratio"] > 0.0 for figure in figures.values())
