"""Joints of a torque arm whose motors do not obey, although nobody said so: they throw no other about."""

import numpy as np
import pytest
from tests.ride import DT, START, circle, target_at
from tests.servo_arm import Unheeding

import ftqp


def led(latency, duration):
    """A planner, its arm, and their circle."""
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, DT, drive=ftqp.Drive(kind="torque", latency=latency * DT))
    arm = Unheeding(robot, START, DT, latency=latency)
    planner.reset(arm.q)
    return robot, planner, arm, circle(robot, START, 0.1, duration)


@pytest.mark.long
@pytest.mark.parametrize("latency", [0, 4])
@pytest.mark.parametrize("at", [0.7, 1.4])
def test_joint_that_falls_unannounced_throws_no_other_about(at, latency):
    """The elbow's motor fails on a circle of 3 s, and for 0.1 s, or until it is braked, the others stay slow.

    With its whole correction coupled into the others joint 6 went to 1.4 to 2.9 times its speed limit.
    """
    robot, planner, arm, path = led(latency, 3.0)
    fails, fastest = round(at / DT), 0.0
    for k in range(fails + 100):
        if k == fails:
            arm.dead = 3
        step = planner.step(arm.measured(), None, target_at(path, k * DT))
        arm.command(step)
        if arm.braked.any():
            break
        if k > fails:
            fastest = max(fastest, float(np.delete(np.abs(arm.v) / robot.limits.v_max, 3).max()))
    assert k > fails + 50
    assert fastest < 0.8


@pytest.mark.long
@pytest.mark.parametrize("latency", [0, 4])
def test_joint_that_was_held_for_a_moment_goes_on(latency):
    """A joint that is held for 30 ms looks like one that has failed, but it follows again."""
    robot, planner, arm, path = led(latency, 4.0)
    for k in range(1500):
        arm.braked[3] = 1000 <= k < 1030
        step = planner.step(arm.measured(), None, target_at(path, k * DT))
        arm.command(step)
        assert (np.abs(arm.v) < robot.limits.v_max).all()
    assert step.status.name == "OK" and np.abs(arm.q - step.reference.q).max() < 1e-3
