"""The oracle of the comparisons agrees with ftqp about where arms are, and finds postures by itself."""

import numpy as np
import pytest
from peers.independent_arm import IndependentArm
from peers.motion_case import turn, vector_of

import ftqp


@pytest.mark.parametrize("name", ["panda", "iiwa14", "xarm7"])
def test_poses_and_jacobians_are_those_of_the_robot(name: str) -> None:
    robot = ftqp.robots.load(name)
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (5, robot.nv))
    R, p, J = IndependentArm(robot).poses(q)
    for k, row in enumerate(q):
        T = robot.pose(row)
        assert np.abs(R[k] - T[:3, :3]).max() < 1e-12 and np.abs(p[k] - T[:3, 3]).max() < 1e-12
        assert np.abs(J[k] - robot.jacobian(row)).max() < 1e-12


def test_restarts_find_a_posture_with_the_locked_joint_in_its_place() -> None:
    robot = ftqp.robots.load("panda")
    here, there = robot.neutral, robot.neutral + np.array([0.5, 0.3, 0.0, 0.4, 0.2, 0.3, 0.1])
    arm, goal = IndependentArm(robot), robot.pose(there)
    found = arm.restarts(goal, here, [2], count=500)
    assert found is not None and found[2] == here[2]
    assert np.abs(arm.errors(found[None], goal)[0]).max() < 1e-5
    goal[:3, 3] += 3.0
    assert arm.restarts(goal, here, [2], count=250) is None


def test_rotation_vectors_come_back() -> None:
    for w in np.random.default_rng(1).normal(size=(20, 3)):
        w *= min(1.0, 3.0 / np.linalg.norm(w))
        assert np.abs(vector_of(turn(w)) - w).max() < 1e-9
