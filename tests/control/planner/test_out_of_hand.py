"""Joints that do not obey although nobody said that they failed: who asks for a brake, and when."""

import numpy as np
import pytest
from tests.ride import DT, START, circle, target_at

import ftqp

JOINT = 6
"""The last joint turns about the tool axis: a task of positions does not see it."""


@pytest.fixture(scope="module")
def robot():
    return ftqp.robots.load("panda")


def runaway(robot, drive, share, emergency):
    """Ticks until the last joint, which moves at ``share`` of its speed limit unasked, asks for its brake.

    None when it has moved for 0.3 s without that; and the last step.
    """
    planner = ftqp.Planner(robot, DT, drive=drive, task=ftqp.Task(rows="position"), **emergency)
    planner.reset(START)
    here = ftqp.Target(pose=robot.pose(START))
    q = START.copy()
    for _ in range(20):
        planner.step(q, None, here)
    for k in range(300):
        q[JOINT] += share * robot.limits.v_max[JOINT] * DT
        step = planner.step(q, None, here)
        if step.brakes.any():
            return k, step
    return None, step


@pytest.mark.parametrize("drive", ["position", "velocity", "torque"])
def test_joint_far_faster_than_asked_and_allowed_is_braked_and_stops_the_arm(robot, drive):
    ticks, step = runaway(robot, drive, 1.28, {})
    assert ticks is not None and step.status.name in ("STOPPING", "STOPPED")
    assert step.brakes.tolist() == (np.arange(7) == JOINT).tolist()


def test_servo_is_given_longer_than_a_torque_arm(robot):
    """A servo that was pushed comes back by itself; a torque arm that runs away does not."""
    fast = {drive: runaway(robot, drive, 1.28, {"emergency": None})[0] for drive in ("velocity", "torque")}
    assert fast["velocity"] * DT >= 0.1
    assert fast["torque"] * DT <= 0.06  # of which the observer needs all but 10 ms


def fastest(robot, beside, *faults):
    """Largest share of a speed limit asked for on a circle that is too fast, with samples ``beside`` off."""
    planner = ftqp.Planner(robot, DT, drive="position", emergency=None)
    planner.reset(START)
    for fault in faults:
        planner.report(fault)
    path, q, most = circle(robot, START, 0.15, 0.8), START, 0.0
    for k in range(700):
        step = planner.step(q, None, target_at(path, k * DT))
        q = step.reference.q + beside * (k % 2)
        healthy = [name not in planner.faults for name in robot.joints]
        most = max(most, float((np.abs(step.reference.v) / robot.limits.v_max)[healthy].max()))
    return most


def test_arm_that_follows_to_the_last_bit_may_use_all_of_its_speed(robot):
    assert fastest(robot, 0.0) == pytest.approx(1.0, abs=1e-6)


def test_arm_with_servos_keeps_four_per_cent_of_its_speed_for_them(robot):
    assert fastest(robot, 1e-5) == pytest.approx(0.96, abs=1e-3)


def test_more_is_kept_while_a_joint_swings_freely(robot):
    """The first joint of a standing arm knows no gravity: the others go on with the task."""
    assert fastest(robot, 1e-5, ftqp.FreeSwinging(0, damping=3.0)) == pytest.approx(0.88, abs=1e-3)
