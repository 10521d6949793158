"""Pose, Jacobian and drift against pinocchio, on chains of every joint type."""

import numpy as np
import pinocchio as pin
import pytest
from random_chains import configuration, random_robot
from records import address, chain_record

from ftqp.kernel.entry import entries as entry

SIZES = (*range(2, 13), 16, 20, 25, 31, 32)


def relative(got, expected):
    """Largest deviation over the largest entry."""
    return np.abs(np.asarray(got) - expected).max() / np.abs(expected).max()


def pose(W):
    """The tip's pose in the record, (4, 4)."""
    T = np.eye(4)
    T[:3, :3] = W["R_tip"][0].reshape(3, 3)
    T[:3, 3] = W["o_tip"][0]
    return T


@pytest.mark.parametrize("joints", SIZES)
def test_pose_jacobian_and_drift_agree_with_pinocchio(joints):
    rng = np.random.default_rng(joints)
    for _ in range(3):
        robot = random_robot(rng, joints)
        W, data = chain_record(robot), robot.model.createData()
        frame = robot.model.getFrameId("tip")
        for _ in range(4):
            q, full, v = configuration(rng, robot)
            entry.kinematics(address(W), q, v)
            pin.forwardKinematics(robot.model, data, full, v, np.zeros(joints))
            pin.updateFramePlacements(robot.model, data)
            world = pin.LOCAL_WORLD_ALIGNED
            J = pin.computeFrameJacobian(robot.model, data, full, frame, world)
            drift = pin.getFrameClassicalAcceleration(robot.model, data, frame, world).vector
            assert relative(pose(W), data.oMf[frame].homogeneous) < 1e-12
            assert relative(W["J"][0, :, :joints], J) < 1e-12
            assert relative(W["drift"][0], drift) < 1e-12


@pytest.mark.parametrize("joints", SIZES)
def test_continuous_joints_may_be_given_by_cosine_and_sine(joints):
    rng = np.random.default_rng(100 + joints)
    robot = random_robot(rng, joints)
    while robot.nq == robot.nv:
        robot = random_robot(rng, joints)
    by_angle, by_pair = chain_record(robot), chain_record(robot)
    q, full, v = configuration(rng, robot)
    entry.kinematics(address(by_angle), q, v)
    entry.kinematics(address(by_pair), full, v)
    assert np.abs(by_pair["q"][0, :joints] - q).max() < 1e-14
    for name in ("R_tip", "o_tip", "J", "drift"):
        assert relative(by_pair[name], by_angle[name]) < 1e-12


def test_an_angle_given_by_cosine_and_sine_keeps_the_turn_of_the_last_command():
    robot = random_robot(np.random.default_rng(4), 12)
    W = chain_record(robot)
    i = int(np.flatnonzero(robot.continuous)[0])
    for turns in (-3, -1, 0, 2, 7):
        W["q_command"][0, i] = 2.0 * np.pi * turns + 3.0
        q = np.zeros(12)
        q[i] = 3.2
        entry.kinematics(address(W), robot.configuration(q), np.zeros(12))
        assert abs(W["q"][0, i] - (2.0 * np.pi * turns + 3.2)) < 1e-13


def test_jacobian_is_the_derivative_of_the_pose():
    rng = np.random.default_rng(5)
    robot, eps = random_robot(rng, 12), 1e-6
    W = chain_record(robot)
    q, _, v = configuration(rng, robot)
    entry.kinematics(address(W), q, v)
    J = W["J"][0, :, :12].copy()
    for i in range(12):
        ends = []
        for sign in (1.0, -1.0):
            moved = q.copy()
            moved[i] += sign * eps
            entry.kinematics(address(W), moved, v)
            ends.append(pose(W))
        turn = pin.log3(ends[0][:3, :3] @ ends[1][:3, :3].T)
        column = np.concatenate([ends[0][:3, 3] - ends[1][:3, 3], turn]) / (2.0 * eps)
        assert np.abs(column - J[:, i]).max() < 1e-8


def test_drift_is_the_derivative_of_the_jacobian_along_the_motion():
    rng = np.random.default_rng(6)
    robot, eps = random_robot(rng, 12), 1e-6
    W = chain_record(robot)
    q, _, v = configuration(rng, robot)
    entry.kinematics(address(W), q, v)
    drift, twists = W["drift"][0].copy(), []
    for sign in (1.0, -1.0):
        entry.kinematics(address(W), q + sign * eps * v, v)
        twists.append(W["J"][0, :, :12] @ v)
    assert np.abs((twists[0] - twists[1]) / (2.0 * eps) - drift).max() < 1e-6


def test_planar_arm_has_the_published_check_values():
    from ftqp.model.catalog import load

    robot = load("planar6")
    W = chain_record(robot)
    entry.kinematics(address(W), np.full(6, np.pi / 12), np.array([0.1, -0.2, 0.3, -0.1, 0.2, 0.05]))
    assert np.abs(W["o_tip"][0, :2] - (0.87241288, 0.89010293)).max() < 1e-8
    assert np.abs(W["drift"][0, :2] - (-0.01803415, -0.04190422)).max() < 1e-8
    singular = np.linalg.svd(W["J"][0, :2, :6], compute_uv=False)
    assert np.abs(singular - (1.844142, 0.311927)).max() < 1e-6
