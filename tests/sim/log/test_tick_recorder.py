"""Raw rows that come a tick at a time, and those that come in blocks, are the same rows."""

import numpy as np
import pytest

from ftqp.control.paths import Circle
from ftqp.faults.kinds import FreeSwinging, Locked
from ftqp.sim.leader import ClockLeader, ClockTargets
from ftqp.sim.log.raw_rows import BLOCK
from ftqp.sim.log.row_sink import MemoryRows
from ftqp.sim.log.signals import JointCondition, columns
from ftqp.sim.log.tick_recorder import TickRecorder

DT = 0.01


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
        recorder.keep(last - first)
    recorder.flush()
    assert len(slow.log) == len(fast.log) == 100
    for name in slow.log.names:
        np.testing.assert_array_equal(slow.log[name], fast.log[name])
    assert set(fast.log["truth.panda_joint4"]) == {JointCondition.FREE_SWINGING}
    assert set(fast.log["belief.panda_joint3"]) == {JointCondition.LOCKED}


def test_full_block_is_handed_on_at_once(made):
    _, _, rows, recorder = made()
    recorder.free[:] = 0.0
    recorder.keep(BLOCK)
    assert len(rows.log) == BLOCK and len(recorder.free) == BLOCK
