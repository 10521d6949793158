"""What is sent beside the reference: a lead stays in the range, and a refused sample makes no jump."""

import numpy as np
import pytest
from tests.servo_arm import ServoArm

import ftqp

DT = 2e-3


@pytest.mark.long
@pytest.mark.parametrize("level", ["acceleration", "velocity"])
def test_lead_sends_no_position_beyond_the_range_that_is_left(level):
    """A slow servo on positions only is sent where it shall be 0.1 s later: that was beyond the end."""
    robot = ftqp.robots.load("panda")
    drive = ftqp.Drive(bandwidth=20.0, takes_velocity=False)
    planner = ftqp.Planner(
        robot, DT, level=level, drive=drive, emergency=None, task=ftqp.Task(rows="position")
    )
    arm = ServoArm(robot.neutral, DT, takes="position only", wn=20.0)
    planner.reset(arm.q)
    planner.report(ftqp.Degraded(1, q_max=0.5))
    top = robot.limits.q_max.copy()
    top[1] = 0.5
    rng = np.random.default_rng(0)
    led, most = 0.0, -np.inf
    for k in range(3000):
        if k % 500 == 0:
            pose = robot.pose(rng.uniform(robot.limits.q_min, robot.limits.q_max))
            pose[:3, 3] *= 1.3
        step = planner.step(arm.measured(), None, ftqp.Target(pose=pose))
        most = max(most, np.max(step.q - top), np.max(robot.limits.q_min - step.q))
        led = max(led, np.abs(step.q - step.reference.q).max())
        arm.command(step)
    assert led > 0.05
    assert most <= 1e-9


def test_velocity_arm_that_slips_as_fast_as_a_quarter_of_its_limit_is_held():
    """A wrist that an unknown load drew away stayed 16 mrad behind, and the path waited for it for ever."""
    robot = ftqp.robots.load("panda")
    drive = ftqp.Drive(kind="velocity", bandwidth=94.0)
    planner = ftqp.Planner(robot, DT, drive=drive, task=ftqp.Task(rows="position"))
    arm = ServoArm(robot.neutral, DT, takes="velocity", wn=94.0)
    arm.push[5] = 94.0 * 0.25 * robot.limits.v_max[5]
    planner.reset(arm.q)
    target = ftqp.Target(pose=robot.pose(robot.neutral))
    for _ in range(750):
        step = planner.step(arm.measured(), None, target)
        arm.command(step)
    assert np.abs(arm.q - step.reference.q).max() < 1e-3
    assert step.status.name == "OK"


def test_refused_sample_takes_feedback_of_a_velocity_arm_away_by_its_acceleration_limit():
    """A servo that slips under a load is sent more than the reference; a bad frame took all of it at once."""
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, DT, level="velocity", drive="velocity")
    arm = ServoArm(robot.neutral, DT, takes="velocity")
    arm.push[:] = 15.0
    planner.reset(arm.q)
    target, extra, most = ftqp.Target(pose=robot.pose(robot.neutral)), np.zeros(7), 0.0
    for k in range(705):
        q = np.full(7, np.nan) if 700 <= k < 703 else arm.measured()
        step = planner.step(q, None, target)
        if 700 <= k < 703:
            assert np.abs(extra).max() > 0.05
            change = np.abs(step.v - step.reference.v - extra)
            most = max(most, float(np.max(change / (robot.limits.a_max * DT))))
        extra = step.v - step.reference.v
        arm.command(step)
    assert most <= 1.0 + 1e-9
