"""Frames: the same from a session and from a log, and right by other means."""

from dataclasses import fields

import numpy as np
import pytest

from ftqp.app.scenario.setup import load
from ftqp.app.view.live_source import arms_of
from ftqp.model import catalog
from ftqp.sim.loop import Simulation
from ftqp.sim.session.frame import DrawnArm, frames_of
from ftqp.sim.session.live_session import Session
from ftqp.sim.session.session_arms import Choice

CLOCK = {"step_time_us", "speed"}


def session(scenario, **kwargs):
    return Session(lambda choice: arms_of(choice, rival=False), Choice(scenario=scenario, **kwargs))


def framed(arm, **given):
    """A picture at rest, all healthy unless it is said."""
    robot, healthy = arm.robot, arm.codes({})
    known = {
        "tick": 7, "t": 0.007, "q": robot.neutral, "v": np.zeros(robot.nv), "truth": healthy,
        "belief": healthy, "target": np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
    }  # fmt: skip
    return arm.frame(**{**known, **given})


def different(one, other):
    return {
        name
        for name in (field.name for field in fields(one))
        if not np.array_equal(np.asarray(getattr(one, name)), np.asarray(getattr(other, name)))
    } - CLOCK


@pytest.mark.parametrize(
    ("scenario", "early"), [("panda-circle", ("faults.0.at=0.1",)), ("modular11-locked", ())]
)
def test_frames_of_a_log_are_those_of_the_session_bit_by_bit(scenario, early):
    setup = load(scenario, early)
    log = Simulation(
        setup.planner, setup.path, q=setup.q, v=setup.v, schedule=setup.schedule, plant=setup.plant,
        follower=setup.follower, duration=0.4, log="memory",
    ).run().log  # fmt: skip
    live = session(scenario, overrides=early)
    dt = setup.planner.dt
    ticks = range(0, len(log), 7)
    compared = 0
    for frame in frames_of(log, setup.robot, ticks):
        if frame.tick:
            assert live.advance(7 * dt) == 7
        assert different(live.frame, frame) == set(), frame.tick
        compared += 1
    assert compared == len(ticks) > 5


@pytest.mark.parametrize("name", ["panda", "modular11", "planar6", "zhang7"])
def test_last_pose_is_the_tip_and_ellipsoid_that_of_the_jacobian(name):
    robot = catalog.load(name)
    q = robot.neutral + 0.1
    frame = framed(DrawnArm(robot), q=q)
    np.testing.assert_allclose(frame.joints[-1], robot.pose(q), atol=1e-12)
    np.testing.assert_array_equal(frame.tip, frame.joints[-1])
    J = robot.jacobian(q)[:3]
    R, axes = frame.axes_rotation, frame.axes
    np.testing.assert_allclose(R @ np.diag(axes**2) @ R.T, J @ J.T, atol=1e-9 * axes[0] ** 2)
    assert np.linalg.det(R) == pytest.approx(1.0)


def test_joint_that_failed_or_is_believed_to_flattens_the_ellipsoid():
    robot = catalog.load("planar6")
    arm, n = DrawnArm(robot), robot.nv
    J = robot.jacobian(robot.neutral)[:3]
    for truth, belief in ((1, 0), (0, 2), (2, 2)):
        codes = np.zeros((2, n), dtype=int)
        codes[0, 1], codes[1, 1] = truth, belief
        frame = framed(arm, truth=codes[0], belief=codes[1])
        np.testing.assert_allclose(frame.axes, np.linalg.svd(np.delete(J, 1, axis=1))[1], atol=1e-12)
    weak = np.full(n, 3)
    np.testing.assert_allclose(framed(arm, truth=weak).axes, np.linalg.svd(J)[1], atol=1e-12)
