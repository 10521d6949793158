"""Pose, Jacobian, drift, inertia and bias against pinocchio, on chains of every joint type."""

import numpy as np
import pinocchio as pin
import pytest
from random_chains import configuration, random_robot

from ftqp.kernel.entry.session import ArmSession

SIZES = (*range(2, 13), 16, *(pytest.param(n, marks=pytest.mark.slow) for n in (20, 25, 31, 32)))


def relative(got, expected):
    """Largest deviation over the largest entry."""
    return np.abs(np.asarray(got) - expected).max() / np.abs(expected).max()


def arm_of(robot):
    """The arm alone."""
    return ArmSession(robot.chain.constants())


def pose(arm):
    """The tip's pose in the arm's record, (4, 4)."""
    T = np.eye(4)
    T[:3, :3] = arm.K.kinematics.R_tip.reshape(3, 3)
    T[:3, 3] = arm.K.kinematics.o_tip
    return T


@pytest.mark.parametrize("joints", SIZES)
def test_pose_jacobian_drift_inertia_and_bias_agree_with_pinocchio(joints):
    rng = np.random.default_rng(joints)
    for _ in range(3):
        robot = random_robot(rng, joints)
        arm, data = arm_of(robot), robot.model.createData()
        frame = robot.model.getFrameId("tip")
        for _ in range(4):
            q, full, v = configuration(rng, robot)
            arm.dynamics(q, v)
            pin.forwardKinematics(robot.model, data, full, v, np.zeros(joints))
            pin.updateFramePlacements(robot.model, data)
            world = pin.LOCAL_WORLD_ALIGNED
            J = pin.computeFrameJacobian(robot.model, data, full, frame, world)
            drift = pin.getFrameClassicalAcceleration(robot.model, data, frame, world).vector
            assert relative(pose(arm), data.oMf[frame].homogeneous) < 1e-12
            assert relative(arm.K.kinematics.J[:, :joints], J) < 1e-12
            assert relative(arm.K.kinematics.drift, drift) < 1e-12
            upper, M = np.triu(pin.crba(robot.model, data, full)), arm.K.kinematics.M[:joints, :joints]
            assert relative(M, upper + np.triu(upper, 1).T) < 1e-12 and np.array_equal(M, M.T)
            bias = pin.rnea(robot.model, data, full, v, np.zeros(joints))
            assert relative(arm.K.kinematics.h[:joints], bias) < 1e-12


@pytest.mark.parametrize("joints", SIZES)
def test_continuous_joints_may_be_given_by_cosine_and_sine(joints):
    rng = np.random.default_rng(100 + joints)
    robot = random_robot(rng, joints)
    while robot.nq == robot.nv:
        robot = random_robot(rng, joints)
    by_angle, by_pair = arm_of(robot), arm_of(robot)
    q, full, v = configuration(rng, robot)
    by_angle.kinematics(q, v)
    by_pair.kinematics(full, v)
    assert np.abs(by_pair.K.state.q[:joints] - q).max() < 1e-14
    for name in ("R_tip", "o_tip", "J", "drift"):
        by = [getattr(arm.K.kinematics, name) for arm in (by_pair, by_angle)]
        assert relative(*by) < 1e-12


def test_jacobian_is_the_derivative_of_the_pose():
    rng = np.random.default_rng(5)
    robot, eps = random_robot(rng, 12), 1e-6
    arm = arm_of(robot)
    q, _, v = configuration(rng, robot)
    arm.kinematics(q, v)
    J = arm.K.kinematics.J[:, :12].copy()
    for i in range(12):
        ends = []
        for sign in (1.0, -1.0):
            moved = q.copy()
            moved[i] += sign * eps
            arm.kinematics(moved, v)
            ends.append(pose(arm))
        turn = pin.log3(ends[0][:3, :3] @ ends[1][:3, :3].T)
        column = np.concatenate([ends[0][:3, 3] - ends[1][:3, 3], turn]) / (2.0 * eps)
        assert np.abs(column - J[:, i]).max() < 1e-8


def test_drift_is_the_derivative_of_the_jacobian_along_the_motion():
    rng = np.random.default_rng(6)
    robot, eps = random_robot(rng, 12), 1e-6
    arm = arm_of(robot)
    q, _, v = configuration(rng, robot)
    arm.kinematics(q, v)
    drift, twists = arm.K.kinematics.drift.copy(), []
    for sign in (1.0, -1.0):
        arm.kinematics(q + sign * eps * v, v)
        twists.append(arm.K.kinematics.J[:, :12] @ v)
    assert np.abs((twists[0] - twists[1]) / (2.0 * eps) - drift).max() < 1e-6
