"""The encoder of a joint without end may begin anew with every turn; such an arm stopped at pi."""

import numpy as np
import pytest

import ftqp

ROBOT = ftqp.robots.load("planar", lengths=(1, 1, 0.5), continuous=True)
Q = np.array([3.12, 1.2, 0.4])
FIRST = np.array([1.0, 0.0, 0.0])


def as_it_is(q):
    return q


def wrapped(q):
    return (q + np.pi) % (2.0 * np.pi) - np.pi


def cosine_and_sine(q):
    return np.stack([np.cos(q), np.sin(q)], axis=1).ravel()


def driven(encoder, turns=0.0):
    """Where the arm ends, without ``turns``, and the statuses on its way across pi."""
    planner = ftqp.Planner(ROBOT, 0.01, level="velocity", task=ftqp.Task(rows=["x", "y"]))
    q, v, seen = Q + 2.0 * np.pi * turns * FIRST, np.zeros(3), set()
    planner.reset(encoder(q), v)
    path = ftqp.paths.Line(ROBOT.pose(Q), [0.1, -0.4, 0.0], duration=1.0)
    target = ftqp.Target(pose=path.start)
    for k in range(101):
        now = path.sample(k * 0.01)
        target.at(now.pose[0], now.twist[0], now.acceleration[0])
        step = planner.step(encoder(q), v, target)
        seen.add(step.status.name)
        q, v = q + 0.01 * step.v, step.v.copy()
    return q - 2.0 * np.pi * turns * FIRST, seen


@pytest.mark.parametrize("encoder", [wrapped, cosine_and_sine])
@pytest.mark.parametrize("turns", [0.0, -3.0, 1e6])
def test_an_arm_goes_across_pi_whatever_its_encoder_says(encoder, turns):
    expected, _ = driven(as_it_is)
    assert expected[0] > np.pi + 0.01
    q, seen = driven(encoder, turns)
    assert seen == {"OK"}
    np.testing.assert_allclose(q, expected, atol=1e-8 if turns == 1e6 else 1e-11)


def test_a_limited_joint_that_jumps_by_a_turn_is_still_not_believed():
    robot = ftqp.robots.load("planar", lengths=(1, 1, 0.5))
    planner = ftqp.Planner(robot, 0.01, level="velocity", task=ftqp.Task(rows=["x", "y"]))
    q = np.array([0.3, 1.2, 0.4])
    planner.reset(q, np.zeros(3))
    step = planner.step(q + 2.0 * np.pi * FIRST, np.zeros(3), ftqp.Target(pose=robot.pose(q)))
    assert step.status.name == "INVALID_INPUT"


@pytest.mark.parametrize("wild", [1e300, -1e300, np.inf, np.nan])
def test_what_is_no_angle_is_not_unwrapped_and_not_believed(wild):
    planner = ftqp.Planner(ROBOT, 0.01, level="velocity", task=ftqp.Task(rows=["x", "y"]))
    planner.reset(Q, np.zeros(3))
    step = planner.step(np.array([wild, 1.2, 0.4]), np.zeros(3), ftqp.Target(pose=ROBOT.pose(Q)))
    assert step.status.name == "INVALID_INPUT"
    assert np.isfinite(step.q).all()
