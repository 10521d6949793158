"""The law that learns reaches what the other joints can: in the cases of Goel et al. 2005 and on a Panda."""

from typing import Any

import numpy as np
import pytest

import ftqp
from ftqp.analysis.learned_law import INITIAL_DEVIATION, Effectiveness, LearnedLaw, LearnedRun, learned_run

CASES = {
    "2R, A": ([1, 1], (0.0, -30.0), "j1", (1.0 + np.sqrt(0.5), np.sqrt(0.5)), 0.0, 0.0),
    "2R, B": ([1, 1], (0.0, -30.0), "j1", (2.0, 0.0), 0.5176, 0.0),
    "2R, C": ([1, 1], (0.0, -30.0), "j1", (0.0, np.sqrt(3.0)), 1.1339, 1.0),
    "Fig. 5": ([1, 1, 1], (-79.3348, 45.0, 42.7735), "j2", (1.5, 1.5), 0.0, 0.0),
    "Fig. 6": ([1, 1, 1], (106.8745, -39.652, 117.3062), "j1", (1.5, 1.5), 1.8708, 0.0),
    "150 deg": ([1, 1, 1], (150.0, -107.9446, 98.8833), "j1", (1.5, 1.5), 0.9044, 0.5687),
}
"""Lengths, start [deg], locked joint, goal, error that remains without learning, least error possible."""


def run(name: str, **settings: Any) -> LearnedRun:
    lengths, start, joint, goal, _, _ = CASES[name]
    robot = ftqp.robots.load("planar", lengths=lengths, continuous=True)
    return learned_run(robot, goal, np.deg2rad(start), [joint], **{"duration": 30.0, **settings})


@pytest.mark.parametrize("name", CASES)
def test_without_learning_it_is_the_law_of_the_paper(name: str) -> None:
    assert run(name, learns=False).error == pytest.approx(CASES[name][4], abs=1e-3)


@pytest.mark.long
@pytest.mark.parametrize("noise", [0.0, 1e-4])
@pytest.mark.parametrize("name", CASES)
def test_with_learning_the_tip_gets_as_near_as_the_other_joints_can(name: str, noise: float) -> None:
    assert run(name, noise=noise).error == pytest.approx(CASES[name][5], abs=2e-3)


def test_a_limit_cycle_ends_at_the_nearest_point() -> None:
    robot = ftqp.robots.load("planar", lengths=[1, 1, 1], continuous=True)
    start = np.deg2rad([10.8852, 72.5087, 30.0])
    plain = learned_run(robot, (-0.8, 0.0), start, ["j3"], learns=False)
    assert np.ptp(plain.errors[-1000:]) > 1.0
    learned = learned_run(robot, (-0.8, 0.0), start, ["j3"])
    nearest = abs(1.0 - 2.0 * np.cos(np.deg2rad(15.0))) - 0.8  # the annulus of joints 1 and 2 begins there
    assert learned.error == pytest.approx(nearest, abs=1e-3)
    assert learned.theta[2] < 0.05


def test_when_an_error_has_settled_is_asked_by_the_old_name_with_a_warning() -> None:
    t, errors = np.arange(4.0), np.array([3.0, 1.0, 2.0, 0.5])
    made = LearnedRun(q=t, error=0.5, t=t, errors=errors, path=t, theta=t)
    assert (made.settling_time(5.0), made.settling_time(1.5), made.settling_time(0.1)) == (0.0, 3.0, None)
    with pytest.warns(DeprecationWarning, match="settling_time"):
        assert made.settled(1.5) == 3.0


def test_a_healthy_arm_moves_as_without_learning() -> None:
    robot = ftqp.robots.load("planar", lengths=[1, 1, 1], continuous=True)
    for start in [0.3, 0.9, 0.7] + 0.3 * np.random.default_rng(3).normal(size=(6, 3)):  # far from singular
        law = LearnedLaw(robot, (1.0, 1.2), gain=0.3)
        plain = LearnedLaw(robot, (1.0, 1.2), gain=0.3, learns=False)
        q = start
        for _ in range(600):
            v = law.command(q)
            np.testing.assert_allclose(v, plain.command(q), atol=1e-4)
            q = q + 0.01 * v
        assert (law.theta > 0.999).all()


@pytest.mark.parametrize("joint", [1, 3, 5])
def test_a_panda_reaches_a_pose_with_a_joint_that_nobody_knows_to_be_locked(joint: int) -> None:
    robot = ftqp.robots.load("panda")
    generator = np.random.default_rng(joint)
    q = robot.neutral + 0.1 * generator.normal(size=7)
    there = q + 0.2 * generator.normal(size=7)
    there[joint] = q[joint]
    found = learned_run(robot, robot.pose(there), q, [joint], rows="pose", duration=20.0)
    assert np.linalg.norm((robot.pose(found.q) - robot.pose(there))[:3, 3]) < 1e-3
    assert found.theta[joint] < 0.05
    assert (found.path[:, joint] == q[joint]).all()


def moved(count: int, theta: list[float], noise: float = 0.0, seed: int = 0) -> Effectiveness:
    """What was learned from random motions of joints with this effectiveness."""
    generator = np.random.default_rng(seed)
    learned = Effectiveness(len(theta), 0.01, noise=noise)
    for _ in range(count):
        J, dq = generator.normal(size=(2, len(theta))), 0.01 * generator.normal(size=len(theta))
        seen = noise * np.sqrt(2.0) * generator.normal(size=2)
        learned.learn(J, dq, J @ (np.array(theta) * dq) + seen)
    return learned


@pytest.mark.parametrize("theta", [[1.0, 1.0, 1.0], [1.0, 0.0, 1.0], [0.4, 1.0, 0.0]])
def test_what_each_joint_does_is_learned_from_the_motion_of_the_tip(theta: list[float]) -> None:
    np.testing.assert_allclose(moved(40, theta).theta, theta, atol=2e-3)


def test_of_a_joint_that_was_never_asked_to_move_nothing_is_learned() -> None:
    learned = Effectiveness(2, 0.01)
    for _ in range(100):
        learned.learn([[1.0, 1.0]], [0.01, 0.0], [0.005])
    assert learned.theta[0] == pytest.approx(0.5, abs=1e-3)
    assert learned.theta[1] == 1.0
    assert learned.deviation[1] >= INITIAL_DEVIATION


def test_a_fault_after_a_long_healthy_motion_is_learned() -> None:
    generator = np.random.default_rng(1)
    learned = Effectiveness(3, 0.01)
    for k in range(6_000):
        J, dq = generator.normal(size=(2, 3)), 0.01 * generator.normal(size=3)
        learned.learn(J, dq, J @ (np.array([1.0, 1.0, 0.0 if k > 5_900 else 1.0]) * dq))
    assert learned.theta[2] < 0.05
