"""The step benchmark runs and says what it promises; no figure of it is judged here."""

import json
import subprocess
import sys
from argparse import Namespace
from itertools import product
from pathlib import Path
from typing import Any

import bench_step
import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "benchmarks" / "bench_step.py"
TASKS = ["panda_velocity", "panda_torque", "chain30_velocity", "chain30_torque"]
OURS = "ftqp active_set"
WAYS = ("best", "readme", "paced")
SUFFIXES = ("", "_readme", "_paced")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """The object printed by a quick run without peers, and the folder of its results."""
    out = tmp_path_factory.mktemp("bench")
    command = [sys.executable, str(SCRIPT), "--quick", "--json", "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), out


def test_stdout_is_one_object_with_a_ratio_for_each_task(run: tuple[dict[str, Any], Path]) -> None:
    result, _ = run
    for suffix in SUFFIXES:
        assert list(result[f"ratios_to_placo{suffix}"]) == TASKS
        assert list(result[f"ratios_to_placo{suffix}_locked"]) == TASKS
        assert list(result[f"p999_ratios_to_placo{suffix}"]) == TASKS


def test_ratios_are_none_without_peers(run: tuple[dict[str, Any], Path]) -> None:
    result, _ = run
    for suffix in SUFFIXES:
        assert set(result[f"ratios_to_placo{suffix}"].values()) == {None}
        assert set(result[f"placo{suffix}"].values()) == {None}


def test_our_own_times_are_there_for_each_task(run: tuple[dict[str, Any], Path]) -> None:
    result, _ = run
    for task, suffix in product(TASKS, SUFFIXES):
        ours = result[f"us{suffix}"][task]
        assert 0.0 < ours["p50"] <= ours["p999"]


def test_every_case_has_both_levels_healthy_and_locked_in_every_way(run: tuple[dict[str, Any], Path]) -> None:
    result, _ = run
    cases = {
        (case["robot"], case["level"], case["locked"] is not None, case["way"]) for case in result["cases"]
    }
    assert cases == {
        (robot, level, locked, way)
        for robot in ("panda", "chain30")
        for level in ("velocity", "torque")
        for locked in (False, True)
        for way in WAYS
    }


def test_every_variant_has_ordered_quantiles(run: tuple[dict[str, Any], Path]) -> None:
    result, _ = run
    for case in result["cases"]:
        for name, row in case["variants"].items():
            assert row["p50"] <= row["p99"] <= row["p999"] <= row["max"]
            assert row["steps"] == result["steps"][case["way"]] // (1 if name == OURS else 5)


@pytest.mark.parametrize(
    "name", ["empty", OURS, f"{OURS}, not calm", "ftqp daqp", "ftqp proxqp", "ftqp osqp"]
)
def test_every_case_has_the_variant(run: tuple[dict[str, Any], Path], name: str) -> None:
    result, _ = run
    assert all(name in case["variants"] for case in result["cases"]), result["left_out"]


def test_what_is_timed_follows_the_target_and_holds_the_joint(
    run: tuple[dict[str, Any], Path],
) -> None:
    result, _ = run
    for case in result["cases"]:
        row = case["variants"][OURS]
        assert row["position_error"] < 5e-3
        assert row["locked_joint_motion"] == 0.0
        assert set(row["statuses"]) == {"OK"}


def test_versions_machine_and_limitations_are_told(run: tuple[dict[str, Any], Path]) -> None:
    result, _ = run
    assert {"ftqp", "numba", "numpy"} <= set(result["programs"]["ftqp"]["versions"])
    assert {"cpu", "cores", "python"} <= set(result["machine"])
    assert result["limitations"]


def test_results_are_written_as_json_and_markdown(run: tuple[dict[str, Any], Path]) -> None:
    result, out = run
    stem = "bench_step-quick"
    assert json.loads((out / f"{stem}.json").read_text()) == result
    text = (out / f"{stem}.md").read_text()
    assert all(
        part in text for part in ("## Limitations", "## Versions", "30 joints, acceleration level", OURS)
    )


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--steps", "0"), "expected at least 1"),
        (("--ways", "paced,brisk"), "expected some of best, readme, paced"),
        (("--update-docs",), "needs a full run with --peers"),
        (("--update-docs", "--peers", "--ways", "paced"), "in every way"),
    ],
)
def test_what_makes_no_sense_is_refused_in_a_sentence(arguments: tuple[str, ...], said: str) -> None:
    command = [sys.executable, str(SCRIPT), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 2 and said in done.stderr


def test_only_a_full_run_replaces_the_result_on_record() -> None:
    full = {"ratios_to_placo": {"panda_velocity": 0.5}}
    lacking = {"ratios_to_placo": {"panda_velocity": None}}
    for result, peers, ways, steps, suffix in (
        (full, True, WAYS, None, None),
        (lacking, True, WAYS, None, "part"),
        (full, False, WAYS, None, "part"),
        (full, True, ("paced",), None, "part"),
        (full, True, WAYS, 100, "part"),
    ):
        options = Namespace(peers=peers, ways=ways, steps=steps, quick=False)
        assert bench_step.suffix(options, result) == suffix
