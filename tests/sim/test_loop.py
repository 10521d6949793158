"""The loop around a planner that keeps what it gets: ticks, faults, logs, and how a run ends."""

from itertools import pairwise

import numpy as np
import pytest

from ftqp.control.paths import Circle, Line
from ftqp.control.planner.status import StepStatus
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Degraded, FreeSwinging, Locked
from ftqp.kernel.layout.enums import OK, STOPPED, STOPPING
from ftqp.sim.leader import SAMPLED, ClockTargets
from ftqp.sim.log.log_file import load_log
from ftqp.sim.loop import Simulation
from ftqp.sim.schedule import FaultEvent, Schedule

MOVING = np.linspace(-0.2, 0.3, 7)


@pytest.fixture
def path(start):
    return Circle(start, 0.05, duration=0.5)


def steps(planner):
    return [call for call in planner.calls if call[0] == "step"]


def test_every_tick_from_zero_to_the_duration_is_done_once(fake, panda, path):
    planner = fake(panda)
    result = Simulation(planner, path, q=panda.neutral).run()
    assert result.steps == 51
    assert len(steps(planner)) == 51
    np.testing.assert_array_equal(
        [call[3] for call in steps(planner)], path.sample(np.arange(51) * 0.01).pose
    )
    np.testing.assert_array_equal(
        [call[4] for call in steps(planner)], path.sample(np.arange(51) * 0.01).twist
    )
    assert planner.calls[0][0] == "reset"


@pytest.mark.parametrize("ticks", [51, 2 * SAMPLED + 10])
def test_clock_aims_at_the_path_at_its_time(path, ticks):
    targets = ClockTargets(path, 0.01, mean=False)
    targets.reset(ticks)
    for k in (0, 1, 37, ticks - 1, 3):
        targets.aim(k)
        sample = path.sample(np.array([k * 0.01]))
        np.testing.assert_array_equal(targets.target.pose, sample.pose[0])
        np.testing.assert_array_equal(targets.target.acceleration, sample.acceleration[0])
        assert targets.progress == min(k * 0.01, 0.5)


def test_fault_is_reported_before_the_step_of_its_tick_or_late_or_never(fake, panda, path):
    planner = fake(panda)
    events = [
        FaultEvent(0.1, Locked(2), 0.2),
        FaultEvent(0.1, Locked(3), "never"),
        FaultEvent(0.3, Locked(5)),
        FaultEvent(9.0, Locked(4)),
    ]
    Simulation(planner, path, q=panda.neutral, schedule=Schedule(events)).run()
    reports = [(k, call[1].joint) for k, call in enumerate(planner.calls) if call[0] == "report"]
    assert reports == [(1 + 20, 2), (1 + 30 + 1, 5)]


def test_planner_cannot_tell_a_coming_fault_from_none(fake, panda, path):
    seen = []
    for events in ([], [FaultEvent(0.3, Locked(2))]):
        planner = fake(panda, a=MOVING)
        Simulation(planner, path, q=panda.neutral, schedule=Schedule(events)).run()
        seen.append(planner.calls[: 1 + 30])
    for healthy, failing in zip(*seen, strict=True):
        for one, other in zip(healthy[1:], failing[1:], strict=True):
            np.testing.assert_array_equal(one, other)


def test_mean_feed_forward_reaches_the_target(fake, panda, start):
    path = Line(start, [0.1, 0, 0], duration=0.5)
    seen = []

    class Planner(fake):
        def step(self, q, v, target, *, tau=None):
            seen.append((target.twist.copy(), target.acceleration.copy()))
            return super().step(q, v, target)

    Simulation(Planner(panda), path, q=panda.neutral, feed_forward="mean").run()
    for (twist, acceleration), (next_twist, _) in pairwise(seen):
        np.testing.assert_allclose(twist + 0.01 * acceleration, next_twist, atol=1e-14)


def test_stop_is_seen_in_the_result(fake, panda, path):
    planner = fake(panda, code=lambda k: OK if k < 20 else STOPPING if k < 25 else STOPPED)
    result = Simulation(planner, path, q=panda.neutral).run()
    assert not result.completed
    assert result.stopped_at == pytest.approx(0.2)
    assert result.final_status is StepStatus.STOPPED
    assert result.status_counts == {StepStatus.OK: 20, StepStatus.STOPPING: 5, StepStatus.STOPPED: 26}


def test_interrupt_leaves_a_complete_log(fake, panda, path, tmp_path):
    def before(k):
        if k == 30:
            raise KeyboardInterrupt

    result = Simulation(fake(panda, before=before), path, q=panda.neutral, log=tmp_path / "log.npy").run()
    assert (result.interrupted, result.completed, result.steps) == (True, False, 30)
    log = load_log(tmp_path)
    assert len(log) == 30
    assert log.metadata["state"] == "interrupted"


def test_log_tells_the_whole_run(fake, panda, path, tmp_path):
    events = [
        FaultEvent(0.1, Locked(2), 0.2),
        FaultEvent(0.3, FreeSwinging(5, damping=1.0), "never"),
        FaultEvent(0.4, Degraded(0, velocity=0.5)),
    ]
    planner = fake(panda, a=MOVING)
    Simulation(
        planner, path, q=panda.neutral, schedule=Schedule(events), log=tmp_path / "log.npy",
        metadata={"scenario": "test"},
    ).run()  # fmt: skip
    log = load_log(tmp_path)
    np.testing.assert_array_equal(log["t"], np.arange(51) * 0.01)
    np.testing.assert_array_equal(log["q"], [call[1] for call in steps(planner)])
    np.testing.assert_array_equal(log["v"], [call[2] for call in steps(planner)])
    np.testing.assert_array_equal(log["a.panda_joint1"], MOVING[0])
    np.testing.assert_array_equal(log["truth.panda_joint3"], np.where(np.arange(51) >= 10, 1, 0))
    np.testing.assert_array_equal(log["belief.panda_joint3"], np.where(np.arange(51) >= 20, 1, 0))
    np.testing.assert_array_equal(log["truth.panda_joint6"], np.where(np.arange(51) >= 30, 2, 0))
    np.testing.assert_array_equal(log["belief.panda_joint6"], 0)
    np.testing.assert_array_equal(log["belief.panda_joint1"], np.where(np.arange(51) >= 40, 3, 0))
    np.testing.assert_array_equal(log["lb"], -1.0)
    np.testing.assert_array_equal(log["ub"], 1.0)
    np.testing.assert_allclose(log["tip"][:, :3], [panda.pose(q)[:3, 3] for q in log["q"]], atol=1e-12)
    np.testing.assert_allclose(log["target"][:, :3], path.sample(log["t"]).pose[:, :3, 3], atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(log["target"][:, 3:], axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(log["position_error"], 1e-4 * np.arange(51))
    np.testing.assert_array_equal(log["qp_iterations"], 3)
    assert (log["step_time"] > 0.0).all()
    assert not any(np.isnan(log[name]).any() for name in log.names)
    about = log.metadata
    assert about["state"] == "finished"
    assert (about["scenario"], about["scheme"], about["backend"]) == ("test", "fake", "none")
    assert [fault["announced"] for fault in about["faults"]] == [0.2, None, 0.4]
    assert about["limits"]["q_max"] == pytest.approx(list(panda.limits.q_max))
    assert about["versions"]["numpy"] == np.__version__


def test_progress_ends_at_the_last_tick(fake, panda, path):
    told = []
    Simulation(
        fake(panda), path, q=panda.neutral, progress=lambda done, all_: told.append((done, all_))
    ).run()
    assert told[-1] == (51, 51)


def test_wrong_arguments_are_clear_sentences(fake, panda, path, tmp_path):
    planner = fake(panda)
    with pytest.raises(InputError, match="'panda_joint9' is not a joint of panda"):
        Simulation(
            planner, path, q=panda.neutral, schedule=Schedule([FaultEvent(1.0, Locked("panda_joint9"))])
        )
    with pytest.raises(InputError, match="'average' is not a feed-forward of a simulation"):
        Simulation(planner, path, q=panda.neutral, feed_forward="average")
    with pytest.raises(
        InputError, match=r"duration of the simulation is 0.001 s, expected at least one step of 0.01 s"
    ):
        Simulation(planner, path, q=panda.neutral, duration=0.001)
    with pytest.raises(InputError, match="q has shape"):
        Simulation(planner, path, q=[0.0])
    (tmp_path / "log.npy").write_text("mine")
    with pytest.raises(InputError, match="exists already"):
        Simulation(planner, path, q=panda.neutral, log=tmp_path / "log.npy").run()
    assert (tmp_path / "log.npy").read_text() == "mine"


def test_log_in_memory_has_the_same_arrays_as_the_file(fake, panda, path, tmp_path):
    def run(log):
        return Simulation(
            fake(panda, a=MOVING), path, q=panda.neutral, log=log, metadata={"scenario": "s"},
            schedule=Schedule([FaultEvent(0.2, Locked(1))]),
        ).run()  # fmt: skip

    kept = run("memory").log
    assert run(tmp_path / "log.npy").log is None
    file = load_log(tmp_path)
    assert kept is not None and kept.names == file.names
    for name in set(kept.names) - {"step_time"}:
        np.testing.assert_array_equal(kept[name], file[name])
    assert kept.metadata.items() <= file.metadata.items()
    assert kept.metadata["state"] == "finished"
