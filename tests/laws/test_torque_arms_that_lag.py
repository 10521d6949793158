"""A joint of a torque arm that lags is taken back by its own loop: it stops no path, and moves no target."""

import numpy as np
import pytest
from tests.ride import DT, START, Ride, circle
from tests.servo_arm import TorqueArm

import ftqp

PANDA = ftqp.robots.load("panda")
PUSH = 60.0


def drawn_aside(rows):
    """A cable draws the wrist of a healthy arm aside from 0.5 s on, farther than joints usually lag."""
    robot = PANDA.with_rotors(PANDA.chain.armature + 0.01)
    planner = ftqp.Planner(PANDA, DT, drive="torque", task=ftqp.Task(rows=rows))
    arm, path = TorqueArm(robot, START, DT), circle(PANDA, START)
    events = {
        500 + k: [lambda planner, arm, k=k: arm.push.__setitem__(6, -PUSH * min(k / 300.0, 1.0))]
        for k in range(301)
    }
    wrist = []
    ride = Ride(PANDA, planner, arm, path, 3.0, events, lambda k, q: wrist.append(q[6]) or q)
    assert np.max(np.abs(np.array(wrist) - ride.sent[:, 6])) > 0.03  # beyond its error band
    return planner, ride, path


@pytest.mark.long
def test_a_wrist_that_is_drawn_aside_holds_up_no_path_that_does_not_need_it():
    planner, ride, _ = drawn_aside("position")
    assert planner.stopped_because is None and not planner.findings
    assert ride.error.max() < 2e-3  # on time, too


@pytest.mark.long
def test_a_joint_that_lags_moves_no_target_of_a_torque_arm():
    """The target gave way by as much as the wrist was behind, and swung with it once it was back."""
    planner, ride, path = drawn_aside("pose")
    assert planner.stopped_because is None
    led = path.sample(DT * np.arange(len(ride.sent)))
    turned = [
        np.arccos(np.clip((np.trace(PANDA.pose(q)[:3, :3] @ pose[:3, :3].T) - 1.0) / 2.0, -1.0, 1.0))
        for q, pose in zip(ride.sent[::20], led.pose[::20], strict=True)
    ]
    assert max(turned) < 1e-4
