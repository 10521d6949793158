"""Gravity's torque on a joint and its gradient, on chains of every joint type."""

import numpy as np
import pytest
from random_chains import random_robot
from records import chain_record

import ftqp
from ftqp.kernel.arm.gravity import gravity_torque, knows_no_gravity
from ftqp.kernel.arm.kinematics import forward_kinematics
from ftqp.kernel.entry.session import ArmSession


def gravity_of(robot, q):
    """g by the recursive Newton-Euler algorithm."""
    arm = ArmSession(robot.chain.constants())
    arm.dynamics(q)
    return arm.K.kinematics.h[: robot.nv].copy()


@pytest.mark.parametrize("joints", [2, 5, 7, 8])
def test_torque_is_that_of_newton_and_euler_and_gradient_that_of_finite_differences(joints):
    rng = np.random.default_rng(joints)
    for _ in range(3):
        robot = random_robot(rng, joints)
        K, slope, step = chain_record(robot), np.zeros(joints), 1e-6
        q = rng.uniform(-2.0, 2.0, joints)
        K.state.q[:joints] = q
        forward_kinematics(K, K.state)
        size = np.abs(gravity_of(robot, q)).max()
        for i in range(joints):
            assert (
                abs(gravity_torque(K.kinematics, K.chain, i, slope) - gravity_of(robot, q)[i]) < 1e-12 * size
            )
            for j in range(joints):
                d = step * np.eye(joints)[j]
                expected = (gravity_of(robot, q + d)[i] - gravity_of(robot, q - d)[i]) / (2.0 * step)
                assert abs(slope[j] - expected) < 1e-7 * size


def test_only_the_first_joint_of_an_upright_arm_knows_no_gravity():
    K = chain_record(ftqp.robots.load("panda"))
    forward_kinematics(K, K.state)
    assert [knows_no_gravity(K.kinematics, K.chain, i) for i in range(7)] == [True, *[False] * 6]
    K.chain.gravity[:] = 0.0
    assert all(knows_no_gravity(K.kinematics, K.chain, i) for i in range(7))
