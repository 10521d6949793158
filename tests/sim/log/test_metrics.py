"""What a run is summed up as, of its whole log and block by block alike."""

import json

import numpy as np
import pytest

from ftqp.control.paths import Circle
from ftqp.faults.kinds import Degraded, FreeSwinging, Locked
from ftqp.sim.log.log_arrays import Log, MemoryRows
from ftqp.sim.log.log_file import load_log
from ftqp.sim.log.metrics import Following, Motion, Quantiles, TalliedRows, summary
from ftqp.sim.loop import Simulation
from ftqp.sim.schedule import FaultEvent, Schedule

KEYS = {
    "scenario", "robot", "scheme", "backend", "level", "dt", "steps", "completed", "final_status",
    "stopped_at", "status_counts", "max_position_error", "rms_position_error", "max_rotation_error",
    "max_limit_violation", "max_failed_joint_motion", "min_sigma_min", "qp", "step_time_us", "faults",
    "max_off_path", "reference", "path_progress", "path_completed_at", "blocked",
}  # fmt: skip


@pytest.fixture
def summarised(fake, panda, start, tmp_path):
    def run(*events, q=None, v=None, **keywords):
        path = Circle(start, 0.05, duration=0.5)
        simulation = Simulation(
            fake(panda, **keywords), path, q=panda.neutral if q is None else q, v=v,
            schedule=Schedule(events), log=tmp_path / "log.npy", metadata={"scenario": "s"},
        )  # fmt: skip
        simulation.run()
        return summary(load_log(tmp_path))

    return run


def test_summary_has_the_promised_keys_and_is_json(summarised):
    result = summarised(FaultEvent(0.1, Locked(2)))
    assert set(result) == KEYS
    assert json.loads(json.dumps(result, allow_nan=False)) == result
    assert set(result["max_limit_violation"]) == {"q", "v", "a", "tau"}
    assert set(result["qp"]) == {"iterations_median", "iterations_max", "residual_max", "failures"}
    assert set(result["step_time_us"]) == {"p50", "p99", "p999", "max"}


def test_errors_counts_and_qp_figures(summarised):
    result = summarised(code=lambda k: 1 if k == 7 else 0)
    assert result["steps"] == 51
    assert result["completed"] is True
    assert result["final_status"] == "OK"
    assert result["stopped_at"] is None
    assert result["status_counts"] == {"OK": 50, "RELAXED": 1}
    assert result["max_position_error"] == pytest.approx(50e-4)
    assert result["rms_position_error"] == pytest.approx(np.sqrt(np.mean((1e-4 * np.arange(51)) ** 2)))
    assert result["max_rotation_error"] == pytest.approx(100e-4)
    assert result["min_sigma_min"] == pytest.approx(0.5)
    assert result["qp"] == {"iterations_median": 3, "iterations_max": 3, "residual_max": 1e-12, "failures": 0}
    assert result["step_time_us"]["p50"] <= result["step_time_us"]["max"]
    assert result["max_limit_violation"] == {"q": 0.0, "v": 0.0, "a": 0.0, "tau": 0.0}


def test_following_error_compares_what_was_sent_for_a_tick_with_the_truth_then(panda):
    joints, ticks = len(panda.joints), 4
    signals = {f"q.{name}": np.arange(4.0) for name in panda.joints}
    signals |= {f"q_command.{name}": np.arange(4.0) + 1.25 for name in panda.joints}
    signals |= {f"truth.{name}": np.zeros(4) for name in panda.joints}
    signals["truth.panda_joint2"] = np.array([0, 0, 1, 1])
    log = Log(None, signals, {}, {}, {"joints": list(panda.joints)})
    expected = np.full((ticks, joints), 0.25)
    expected[0], expected[2:, 1] = 0.0, np.nan
    np.testing.assert_array_equal(Following().add(log), expected)


def test_motion_of_a_joint_in_a_real_brake_counts_from_the_time_it_is_slow(panda):
    signals = {f"{group}.{name}": np.zeros(4) for group in ("q", "v") for name in panda.joints}
    signals |= {f"truth.{name}": np.zeros(4, dtype=int) for name in panda.joints} | {"t": np.arange(4.0)}
    signals["truth.panda_joint2"] = np.ones(4, dtype=int)
    signals["v.panda_joint2"] = np.array([0.5, 0.1, 1e-5, 1e-5])
    signals["q.panda_joint2"] = np.array([0.0, 0.3, 0.4, 0.40001])
    fault = {"kind": "locked", "joint": "panda_joint2", "index": 1, "at": 0.0, "announced": 0.0}
    about = {"joints": list(panda.joints), "faults": [fault], "plant_tolerance": 1e-4}
    motion = Motion(about)
    motion.add(Log(None, signals, {}, {}, about))
    assert motion.by_joint == {"panda_joint2": pytest.approx(1e-5)}


def test_excess_of_a_working_joint_is_measured(summarised, panda):
    a = np.zeros(7)
    a[3] = panda.limits.a_max[3] + 0.5
    v = np.zeros(7)
    v[2] = -panda.limits.v_max[2] - 0.25
    result = summarised(a=a, v=v)
    assert result["max_limit_violation"]["a"] == pytest.approx(0.5)
    assert result["max_limit_violation"]["v"] == pytest.approx(
        max(0.25, 0.5 * a[3] - panda.limits.v_max[3]), abs=1e-9
    )


def test_swing_of_a_free_joint_is_measured(summarised):
    assert (
        summarised(FaultEvent(0.1, FreeSwinging(3, damping=0.1)))["max_failed_joint_motion"]["panda_joint4"]
        > 0.05
    )


def test_degraded_joint_counts_against_what_is_left_once_it_has_been_inside(summarised, panda):
    v = np.zeros(7)
    v[4] = 0.9 * panda.limits.v_max[4]
    still_fast = summarised(FaultEvent(0.1, Degraded(4, velocity=0.5)), v=v)
    assert still_fast["max_limit_violation"]["v"] == 0.0


@pytest.fixture
def run(fake, panda, start, tmp_path):
    """A run with two failures, a limit that is broken and one status that is not OK."""
    a = np.linspace(-1.0, 1.0, 7)
    a[3] = panda.limits.a_max[3] + 0.5
    simulation = Simulation(
        fake(panda, a=a, code=lambda k: 1 if k == 7 else 5 if k > 40 else 0),
        Circle(start, 0.05, duration=0.5),
        q=panda.neutral,
        schedule=Schedule([FaultEvent(0.1, Locked(2), 0.2), FaultEvent(0.1, Degraded(4, velocity=0.01))]),
        log=tmp_path / "log.npy",
    )
    return simulation.run(), load_log(tmp_path)


def test_a_run_sums_itself_up_as_its_log_does(run):
    result, log = run
    assert result.summary == summary(log)
    assert result.summary["stopped_at"] == pytest.approx(0.41)
    assert result.summary["max_limit_violation"]["a"] > 0.4
    json.dumps(result.summary, allow_nan=False)


@pytest.mark.parametrize("size", [1, 7, 50])
def test_blocks_of_any_size_give_the_same_figures(run, size):
    _, log = run
    (table,) = log.rows.blocks()
    kept = TalliedRows(MemoryRows(log.rows.columns, log.metadata), log.rows.columns, log.metadata)
    for first in range(0, len(table), size):
        kept.write(first, table[first : first + size])
    whole, pieces = summary(log), kept.facts()
    assert whole.pop("rms_position_error") == pytest.approx(pieces.pop("rms_position_error"), rel=1e-14)
    assert pieces == whole


def quantiles(values, pieces=3):
    found = Quantiles()
    for piece in np.array_split(values, pieces):
        found.add(piece)
    return found


def test_quantiles_of_few_numbers_are_those_of_numpy_and_what_is_no_number_is_left_out():
    values = np.random.default_rng(0).lognormal(size=5000)
    for percent in (0.0, 50.0, 99.0, 99.9, 100.0):
        assert quantiles([np.nan, *values, np.inf]).at(percent) == np.percentile(values, percent)
    assert Quantiles().at(50.0) is None
