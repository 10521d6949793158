"""What leads an arm: each leader takes aim and steps like what it wraps."""

import numpy as np
import pytest

import ftqp
from ftqp.control.paths import Circle, Hold
from ftqp.sim.base.disturbances import Sinusoid
from ftqp.sim.base.moving_world import FreeBase, MovingWorld
from ftqp.sim.leader import SAMPLED, ClockLeader, ClockTargets, ProgressLeader, Standing

DT = 0.01


@pytest.fixture
def path(start):
    return Circle(start, 0.05, duration=1.0)


@pytest.mark.parametrize("ticks", [101, 2 * SAMPLED + 10])
def test_clock_aims_at_the_path_at_its_time(fake, panda, path, ticks):
    targets = ClockTargets(path, DT, mean=False)
    leader = ClockLeader(fake(panda, DT), targets)
    leader.reset(panda.neutral, np.zeros(7), ticks)
    for k in (0, 1, 57, ticks - 1, 3):
        leader.aim(k, panda.neutral)
        sample = path.sample(np.array([k * DT]))
        np.testing.assert_array_equal(leader.target.pose, sample.pose[0])
        np.testing.assert_array_equal(leader.target.acceleration, sample.acceleration[0])
        at = min(k * DT, 1.0)
        assert leader.standing == Standing(at, at, status=None, over=False, finished=True, blocked=None)


def test_progress_leads_until_the_path_is_done(panda, path):
    planner = ftqp.Planner(panda, DT, level="velocity", task=ftqp.Task(mode="scaled"))
    leader = ProgressLeader(ftqp.PathFollower(planner, path))
    q, v, k = panda.neutral.copy(), np.zeros(7), 0
    leader.reset(q, v, 1000)
    while not leader.standing.over:
        aimed = leader.standing.reached
        leader.aim(k, q)
        step = leader.step(q, v)
        assert leader.standing.progress == aimed
        q, v, k = step.q.copy(), step.v.copy(), k + 1
    standing = leader.standing
    assert standing.finished and standing.status is ftqp.PathStatus.DONE and standing.blocked is None
    assert standing.reached == pytest.approx(1.0) and 101 <= k < 300


def test_clock_on_a_moving_base_senses_and_steps_its_world(panda):
    planner = ftqp.Planner(panda, DT, level="velocity")
    world = MovingWorld(ftqp.InertialTask(planner), FreeBase(), [Sinusoid("x", 0.01, frequency=1.0)])
    path = Hold(world.start() @ panda.pose(panda.neutral), duration=1.0)
    leader = ClockLeader(planner, ClockTargets(path, DT, mean=False), world)
    q, v = panda.neutral.copy(), np.zeros(7)
    leader.reset(q, v, 101)
    for k in range(30):
        leader.aim(k, q)
        np.testing.assert_allclose(world.tip_pose, world.base_pose @ panda.pose(q), atol=1e-12)
        step = leader.step(q, v)
        q, v = step.q.copy(), step.v.copy()
    assert leader.world is world and world.base_pose[0, 3] != 0.0
