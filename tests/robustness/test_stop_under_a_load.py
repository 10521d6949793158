"""A stop ends at rest although a motor cannot carry its load: torque limits give way, and nothing swings."""

import numpy as np
import pytest

import ftqp

DT = 2e-3


@pytest.mark.parametrize("burden", [ftqp.Degraded(1, torque=0.05), ftqp.Payload(mass=22.0)])
def test_arm_that_cannot_carry_its_load_comes_to_rest(level, burden):
    """To lessen an excess of torque that nothing removes, healthy joints swung at their limits for ever."""
    robot = ftqp.robots.load("xarm7")
    rng = np.random.default_rng(0)
    span = robot.limits.q_max - robot.limits.q_min
    q = np.clip(robot.neutral + rng.uniform(-0.15, 0.15, 7) * span, robot.limits.q_min, robot.limits.q_max)
    planner = ftqp.Planner(robot, DT, level=level)
    planner.reset(q)
    if isinstance(burden, ftqp.Payload):
        planner.carry(burden)
    else:
        planner.report(burden)
    pose = robot.pose(q).copy()
    pose[:3, 3] += 0.1 * rng.normal(size=3)
    target = ftqp.Target(pose=pose)
    for _ in range(200):
        q = planner.step(q, None, target).q.copy()
    planner.stop()
    for _ in range(round(6.0 / DT)):
        step = planner.step(q, None, target)
        q = step.q.copy()
    assert step.status is ftqp.StepStatus.STOPPED
    for _ in range(500):
        step = planner.step(q, None, target)
        assert np.abs(step.v).max() < 1e-12
