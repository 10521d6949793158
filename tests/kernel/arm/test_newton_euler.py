"""Torques of an acceleration without M, against pinocchio, on chains of every joint type."""

import numpy as np
import pinocchio as pin
import pytest
from random_chains import configuration, random_robot
from records import chain_record

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.arm.newton_euler import torques_of


@pytest.mark.parametrize("joints", [1, 2, 5, 8])
def test_torques_agree_with_pinocchio(joints):
    rng = np.random.default_rng(joints)
    for _ in range(4):
        robot = random_robot(rng, joints)
        K, (q, full, v) = chain_record(robot), configuration(rng, robot)
        a, viscous = rng.normal(size=joints) * 5.0, rng.uniform(0.0, 2.0, joints)
        K.state.q[:joints], K.state.v[:joints], K.chain.viscous[:joints] = q, v, viscous
        forward_kinematics(K, K.state)
        motion(K, K.state)
        torques_of(K.state, K.kinematics, K.chain, a)
        expected = pin.rnea(robot.model, robot.model.createData(), full, v, a) + viscous * v
        assert np.abs(K.kinematics.tau[:joints] - expected).max() < 1e-12 * np.abs(expected).max()


def test_torques_leave_the_snapshot_as_it_was():
    """M and h may be asked for behind them, in the same tick."""
    rng = np.random.default_rng(3)
    robot = random_robot(rng, 7)
    K, (q, _, v) = chain_record(robot), configuration(rng, robot)
    K.state.q[:7], K.state.v[:7] = q, v
    forward_kinematics(K, K.state)
    motion(K, K.state)
    dynamics(K, K.state)
    M, h = K.kinematics.M.copy(), K.kinematics.h.copy()
    torques_of(K.state, K.kinematics, K.chain, rng.normal(size=7))
    dynamics(K, K.state)
    assert np.array_equal(K.kinematics.M, M) and np.array_equal(K.kinematics.h, h)
