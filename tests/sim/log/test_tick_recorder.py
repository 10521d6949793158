"""Raw rows that come a tick at a time, and those that come in blocks, are the same rows."""

import numpy as np
import pytest

from ftqp.control.paths import Circle
from ftqp.control.planner.planner import Planner
from ftqp.faults.kinds import Degraded, FreeSwinging, Locked
from ftqp.sim.leader import ClockLeader, ClockTargets
from ftqp.sim.log.log_arrays import MemoryRows
from ftqp.sim.log.signals import columns
from ftqp.sim.log.tick_recorder import TickRecorder
from ftqp.sim.loop import MEMORY, Simulation
from ftqp.sim.schedule import FaultEvent, Schedule

DT = 0.01
JACOBIAN = np.random.default_rng(0).standard_normal((6, 7)) * (np.arange(7) != 2)


@pytest.fixture
def made(fake, panda, start):
    def make():
        planner = fake(panda, DT)
        leader = ClockLeader(planner, ClockTargets(Circle(start, 0.05, duration=1.0), DT, mean=False))
        leader.reset(panda.neutral, np.zeros(7), 101)
        rows = MemoryRows(columns(panda.joints, panda.chain.prismatic, "acceleration"), {})
        return planner, leader, rows, TickRecorder(rows, planner, leader)

    return make


def test_block_of_raw_rows_gives_the_log_of_its_ticks(made, panda):
    planner, leader, slow, recorder = made()
    recorder.fail(FreeSwinging(3))
    planner.report(Locked(2))
    raw = []
    for k in range(100):
        leader.aim(k, panda.neutral)
        free = recorder.free
        recorder.write(k * DT, panda.neutral, np.zeros(7), leader.step(panda.neutral, np.zeros(7)), 1000)
        raw.append(free[0].copy())
    recorder.flush()
    planner, _, fast, recorder = made()
    recorder.fail(FreeSwinging(3))
    planner.report(Locked(2))
    for first, last in ((0, 40), (40, 41), (41, 100)):
        recorder.free[: last - first] = raw[first:last]
        recorder.free[: last - first, recorder.layout.fields["truth"]] = np.nan
        recorder.free[: last - first, recorder.layout.fields["belief"]] = np.nan
        recorder.free[: last - first, recorder.layout.fields["jacobian"]] = JACOBIAN.ravel()
        recorder.keep(last - first, 6)
    recorder.flush()
    assert len(slow.log) == len(fast.log) == 100
    sigma = np.linalg.svd(JACOBIAN, compute_uv=False)
    np.testing.assert_allclose(fast.log["sigma_min"], sigma[-1])
    np.testing.assert_allclose(fast.log["manipulability"], sigma.prod())
    np.testing.assert_allclose(fast.log["condition"], sigma[0] / sigma[-1])
    for name in set(slow.log.names) - {"sigma_min", "manipulability", "condition"}:
        np.testing.assert_array_equal(slow.log[name], fast.log[name])
    assert set(fast.log["truth.panda_joint4"]) == {FreeSwinging.number}
    assert set(fast.log["belief.panda_joint3"]) == {Locked.number}


def test_log_without_measures_of_singularity_is_the_same_otherwise(panda, start):
    logs = []
    for singularities in (True, False):
        planner, path = Planner(panda, DT), Circle(start, 0.05, duration=0.5)
        schedule = Schedule([FaultEvent(0.2, Degraded(1, velocity=0.5), announced=0.2)])
        made = Simulation(
            planner, path, q=panda.neutral, schedule=schedule, log=MEMORY, singularities=singularities
        )
        logs.append(made.run().log)
    whole, lean = logs
    assert np.isfinite(whole["sigma_min"]).all() and np.isnan(lean["sigma_min"]).all()
    for name in set(whole.names) - {"sigma_min", "manipulability", "condition", "step_time"}:
        np.testing.assert_array_equal(whole[name], lean[name])
