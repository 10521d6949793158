"""Frames: the same from a session and from a log, and right by other means."""

from dataclasses import fields

import numpy as np
import pytest

from ftqp.app.scenario.setup import load
from ftqp.app.view.arms_of_scenario import arms_of
from ftqp.model import catalog
from ftqp.sim.loop import Simulation
from ftqp.sim.session.live_session import Session
from ftqp.sim.session.session_arms import Choice
from ftqp.sim.session.tick_facts import Facts
from ftqp.viz.live.frame import DrawnArm, frame_of, frames_of

CLOCK = {"step_time_us"}


def session(scenario, **kwargs):
    return Session(lambda choice: arms_of(choice, rival=False), Choice(scenario=scenario, **kwargs))


def facts(robot, q=None, **others):
    n = robot.nv
    known = {
        "tick": 7, "t": 0.007, "q": robot.neutral if q is None else q, "v": np.zeros(n),
        "truth": np.zeros(n, dtype=int), "belief": np.zeros(n, dtype=int),
        "target_position": np.zeros(3), "target_quaternion": np.array([0.0, 0.0, 0.0, 1.0]),
        "status": 0, "path_status": 0, "position_error": 0.0, "rotation_error": 0.0, "step_time": 10.0,
    }  # fmt: skip
    return Facts(**{**known, **others})


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
    arm, dt = DrawnArm(setup.robot), setup.planner.dt
    ticks = range(0, len(log), 7)
    compared = 0
    for frame in frames_of(log, setup.robot, ticks):
        if frame.tick:
            assert live.advance(7 * dt) == 7
        assert different(frame_of(live.facts, arm), frame) == set(), frame.tick
        compared += 1
    assert compared == len(ticks) > 5


@pytest.mark.parametrize("name", ["panda", "modular11", "planar6", "zhang7"])
def test_last_pose_is_the_tip_and_ellipsoid_that_of_the_jacobian(name):
    robot = catalog.load(name)
    q = robot.neutral + 0.1
    frame = frame_of(facts(robot, q), DrawnArm(robot))
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
        frame = frame_of(facts(robot, truth=codes[0], belief=codes[1]), arm)
        np.testing.assert_allclose(frame.axes, np.linalg.svd(np.delete(J, 1, axis=1))[1], atol=1e-12)
    weak = np.full(n, 3)
    np.testing.assert_allclose(frame_of(facts(robot, truth=weak), arm).axes, np.linalg.svd(J)[1], atol=1e-12)
