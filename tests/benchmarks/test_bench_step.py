"""The step benchmark runs and says what it promises; no figure of it is judged here."""

import json
from itertools import product
from pathlib import Path
from typing import Any

import pytest
from tests.scripts import ROOT, ran, told

TASKS = ["panda_velocity", "panda_torque", "chain30_velocity", "chain30_torque"]
OURS = "ftqp active_set"
VARIANTS = ("empty", OURS, f"{OURS}, not calm", "ftqp daqp", "ftqp proxqp", "ftqp osqp")
WAYS = ("best", "readme", "paced")
SUFFIXES = ("", "_readme", "_paced")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """The object printed by a quick run without peers, and the folder of its results."""
    out = tmp_path_factory.mktemp("bench")
    return json.loads(told("benchmarks/bench_step.py", "--quick", "--json", "--out", out)), out


def test_every_task_has_a_time_of_ours_and_a_ratio_which_is_none_without_peers(run) -> None:
    result, _ = run
    for suffix in SUFFIXES:
        assert result[f"ratios_to_placo{suffix}"] == dict.fromkeys(TASKS)
        assert list(result[f"ratios_to_placo{suffix}_locked"]) == TASKS
        assert list(result[f"p999_ratios_to_placo{suffix}"]) == TASKS
    for task, suffix in product(TASKS, SUFFIXES):
        ours = result[f"us{suffix}"][task]
        assert 0.0 < ours["p50"] <= ours["p999"]


def test_every_case_has_every_variant_in_every_way(run) -> None:
    result, _ = run
    cases = [(case["robot"], case["level"], bool(case["locked"]), case["way"]) for case in result["cases"]]
    every = product(("panda", "chain30"), ("velocity", "torque"), (False, True), WAYS)
    assert set(cases) == set(every)
    for case in result["cases"]:
        assert set(VARIANTS) <= set(case["variants"]), result["left_out"]
        for name, row in case["variants"].items():
            assert row["p50"] <= row["p99"] <= row["p999"] <= row["max"]
            assert row["steps"] == result["steps"][case["way"]] // (1 if name == OURS else 5)


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


@with_history
def test_what_is_no_commit_is_one_sentence() -> None:
    done = ran(SCRIPT, "--against", "no-such-commit")
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.startswith("'no-such-commit' is no commit of this repository")
