"""Joints that do not obey: the error band during a stop, and speed that nobody asked for."""

import numpy as np
import pytest

import ftqp

ROBOT = ftqp.robots.load("planar", count=3)
LIMITS = ROBOT.limits


def stopped(dt, sigma=0.0, **settings):
    """A planner whose arm was stopped at rest."""
    noise = ftqp.Noise(q=sigma) if sigma else None
    planner = ftqp.Planner(ROBOT, dt, drive="position", noise=noise, **settings)
    planner.reset(ROBOT.neutral)
    target = ftqp.Target(pose=ROBOT.pose(ROBOT.neutral))
    planner.step(ROBOT.neutral, None, target)
    planner.stop()
    return planner, target


@pytest.mark.parametrize("sigma", [0.0, 1e-3])
@pytest.mark.parametrize(("joint", "side"), [(0, 1.0), (2, -1.0)])
def test_in_a_stop_a_joint_that_leaves_its_error_band_for_twenty_milliseconds_asks_for_its_brake(
    joint, side, sigma
):
    dt = 0.004
    band = 0.02 + 6.0 * sigma
    planner, target = stopped(dt, sigma)
    beside, ticks, asked = 0.0, 0, None
    q = ROBOT.neutral.copy()
    for k in range(60):
        beside = min(beside + 0.6 * dt, 1.04 * band)
        q[joint] = ROBOT.neutral[joint] + side * beside + (1e-9 if k % 2 else 0.0)
        step = planner.step(q, None, target)
        ticks += beside > band
        if step.brakes.any() and asked is None:
            asked = ticks
            assert step.brakes.tolist() == (np.arange(3) == joint).tolist()
    assert asked == 5


@pytest.mark.parametrize("joint", [0, 2])
def test_within_its_error_band_a_joint_asks_for_no_brake_nor_outside_while_nothing_is_stopped(joint):
    dt = 0.004
    for stop, most in ((True, 0.96 * 0.02), (False, 0.06)):
        planner, target = stopped(dt, emergency=None)
        if not stop:
            planner.reset(ROBOT.neutral)
            target = ftqp.Target(pose=ROBOT.pose(ROBOT.neutral))
        q = ROBOT.neutral.copy()
        for k in range(40):
            q[joint] = ROBOT.neutral[joint] + min(0.6 * dt * k, most)
            step = planner.step(q, None, target)
            assert not step.brakes.any()


def test_a_joint_that_comes_back_into_its_error_band_is_counted_anew():
    dt = 0.004
    planner, target = stopped(dt)
    q, away = ROBOT.neutral.copy(), [*np.linspace(0.0, 0.0199, 12), *([0.021] * 4 + [0.0195]) * 6]
    for beside in away:
        q[1] = ROBOT.neutral[1] + beside
        assert not planner.step(q, None, target).brakes.any()


def test_a_joint_that_is_known_to_have_failed_asks_for_nothing():
    planner = ftqp.Planner(ROBOT, 0.01, drive="position", task=ftqp.Task(rows=("x",)), emergency=None)
    planner.reset(ROBOT.neutral)
    planner.report(ftqp.Locked(2))
    target = ftqp.Target(position=ROBOT.pose(ROBOT.neutral)[:3, 3])
    q = ROBOT.neutral.copy()
    for _ in range(25):
        q[2] -= 1.28 * LIMITS.v_max[2] * 0.01
        assert not planner.step(q, None, target).brakes.any()


def test_a_joint_out_of_hand_is_seen_behind_one_that_has_failed():
    planner = ftqp.Planner(ROBOT, 0.01, drive="position", task=ftqp.Task(rows=("x",)), emergency=None)
    planner.reset(ROBOT.neutral)
    planner.report(ftqp.Locked(0))
    target, q = ftqp.Target(position=ROBOT.pose(ROBOT.neutral)[:3, 3]), ROBOT.neutral.copy()
    for _ in range(16):
        q[2] -= 1.28 * LIMITS.v_max[2] * 0.01
        step = planner.step(q, None, target)
    assert step.brakes.tolist() == [False, False, True]
