"""Joints that stand are moved a little along self-motions, which shows whether they still can."""

import logging
from typing import Any

import numpy as np
import pytest

import ftqp
from ftqp.control.planner.response.probing import FARTHEST, LEAST_SHARE
from ftqp.core.errors import InputError

DT = 1e-3
SIGMA = 1e-4
HALF_SECOND = 0.5
QUIET = 1e-7
"""Noise of an encoder that hardly has any; one without is taken for frozen."""


def planner_of(probe_after: float | None, **settings: Any) -> ftqp.Planner:
    robot = settings.pop("robot", None) or ftqp.robots.load("panda").with_friction(coulomb=1e-4)
    detector = ftqp.Detector(probe_after=probe_after)
    return ftqp.Planner(robot, DT, noise=ftqp.Noise(q=SIGMA), detector=detector, **settings)


def stood(
    planner: ftqp.Planner, ticks: int, *, locked: int | None = None, at: int = 0, sigma: float = SIGMA
) -> list[ftqp.Step]:
    """Steps of an arm that is to stand where it is; a joint locks at a tick, and nobody says so."""
    robot, generator = planner.robot, np.random.default_rng(4)
    q = robot.neutral.copy()
    planner.reset(q)
    target, steps = ftqp.Target(pose=robot.pose(q)), []
    for k in range(ticks):
        step = planner.step(q + sigma * generator.standard_normal(robot.nv), None, target)
        steps.append(step.copy())
        stays, q = q, step.q.copy()
        if locked is not None and k >= at:
            q[locked] = stays[locked]
    return steps


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize("scheme", ["mvn", "man", "mke", "rmp"])
def test_a_probed_joint_moves_by_a_little_and_comes_back_while_the_tip_stays(level: str, scheme: str) -> None:
    planner = planner_of(HALF_SECOND, level=level, scheme=scheme)
    robot = planner.robot
    steps = stood(planner, 750, sigma=QUIET)
    q = np.array([step.reference.q for step in steps])
    far = np.abs(q - robot.neutral).max(axis=0)
    assert far.max() == pytest.approx(FARTHEST, rel=0.15)
    assert (far >= LEAST_SHARE * FARTHEST).sum() >= 2
    assert np.abs(q[499] - robot.neutral).max() < 1e-6
    assert np.abs(q[720] - robot.neutral).max() < 0.1 * FARTHEST
    assert max(np.linalg.norm(robot.pose(one)[:3, 3] - robot.pose(robot.neutral)[:3, 3]) for one in q) < 1e-5
    assert {step.status for step in steps} == {ftqp.StepStatus.OK}
    if level == "acceleration":
        a = np.array([step.a for step in steps])
        assert (np.abs(a) <= 0.6 * robot.limits.a_max).all()


def test_without_probing_commands_are_those_of_a_detector_that_never_heard_of_it() -> None:
    for one, other in zip(stood(planner_of(None), 300), stood(planner_of(10.0), 300), strict=True):
        assert (one.q == other.q).all() and (one.a == other.a).all()


@pytest.mark.long
def test_a_lock_at_rest_is_found_within_a_second_by_probing_alone() -> None:
    probing, alone = planner_of(HALF_SECOND), planner_of(None)
    stood(probing, 1700, locked=2, at=700)
    assert [(finding.joint, finding.kind) for finding in probing.findings] == [("panda_joint3", "locked")]
    assert probing.findings[0].detected_at < 1.7
    stood(alone, 1700, locked=2, at=700)
    assert alone.findings == ()


def test_a_joint_that_no_self_motion_moves_is_left_alone_and_named(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "ftqp"):
        stood(planner_of(HALF_SECOND), 900)
    said = [message for message in caplog.messages if "cannot be probed" in message]
    assert any("panda_joint4" in message for message in said)
    assert len(said) == len(set(said))


def test_a_joint_that_friction_holds_stays_while_others_are_probed() -> None:
    robot = ftqp.robots.load("panda").with_friction(coulomb=[1e-4] * 6 + [2.0])
    planner = planner_of(HALF_SECOND, robot=robot, task=ftqp.Task(rows="position"))
    far = np.abs(np.array([step.q for step in stood(planner, 900, sigma=QUIET)]) - robot.neutral).max(axis=0)
    assert far[6] < 1e-6 and far.max() > 1e-3


def test_nothing_is_probed_during_a_stop() -> None:
    planner, generator = planner_of(HALF_SECOND), np.random.default_rng(4)
    q = planner.robot.neutral.copy()
    planner.reset(q)
    target, ends = ftqp.Target(pose=planner.robot.pose(q)), []
    for k in range(1500):
        if k == 560:
            planner.stop()
        q = planner.step(q + QUIET * generator.standard_normal(7), None, target).q.copy()
        ends.append(q)
    assert np.abs(ends[600] - planner.robot.neutral).max() > 1e-4
    assert np.abs(np.array(ends[800:]) - ends[-1]).max() < 1e-9


def test_an_arm_without_self_motion_cannot_be_probed_and_says_so() -> None:
    with pytest.raises(InputError, match="puma560 has 6 joints for 6 task rows and no self-motion"):
        planner_of(HALF_SECOND, robot=ftqp.robots.load("puma560"))


def test_a_closed_form_cannot_be_probed_by_and_says_so() -> None:
    with pytest.raises(InputError, match="closed form 'pseudoinverse' has no objective"):
        planner_of(HALF_SECOND, scheme="pseudoinverse", level="velocity")


@pytest.mark.parametrize("given", [0.0, -1.0, float("nan")])
def test_a_time_that_is_none_is_refused(given: float) -> None:
    with pytest.raises(InputError, match="probe_after"):
        ftqp.Detector(probe_after=given)
