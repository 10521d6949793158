"""The bound on torques holds in every posture, and is reached where a posture leaves no room."""

import numpy as np
import pytest
from random_chains import configuration, random_robot
from records import chain_record

import ftqp
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.arm.newton_euler import torques_of
from ftqp.kernel.arm.torque_bound import torque_bound


@pytest.mark.long
@pytest.mark.parametrize("joints", [1, 2, 4, 8])
def test_no_torque_is_beyond_the_bound(joints):
    rng = np.random.default_rng(joints)
    closest = 0.0
    for _ in range(40):
        robot = random_robot(rng, joints)
        K, (q, _, v) = chain_record(robot), configuration(rng, robot)
        a = rng.normal(size=joints) * rng.choice([0.0, 0.1, 10.0])
        K.state.q[:joints], K.chain.viscous[:joints] = q, rng.uniform(0.0, 2.0, joints)
        K.state.v[:joints] = v * rng.choice([0.0, 0.1, 3.0])
        forward_kinematics(K, K.state)
        motion(K, K.state)
        torques_of(K.state, K.kinematics, K.chain, a)
        tau = np.abs(K.kinematics.tau[:joints])
        torque_bound(K.state, K.kinematics, K.chain, a)
        bound = K.kinematics.tau[:joints]
        assert np.all(tau <= bound * (1.0 + 1e-12))
        closest = max(closest, float((tau / bound).max()))
    assert closest > 0.5, "it is not so wide as to be of no use"


def test_bound_is_reached_by_a_stretched_arm_that_turns_all_joints_one_way():
    """A planar arm without gravity: all lengths, speeds and accelerations along one another."""
    robot = ftqp.robots.load("planar(3)")
    K = chain_record(robot)
    a = np.array([2.0, 1.0, 0.5])
    forward_kinematics(K, K.state)
    motion(K, K.state)
    torques_of(K.state, K.kinematics, K.chain, a)
    tau = K.kinematics.tau[:3].copy()
    torque_bound(K.state, K.kinematics, K.chain, a)
    assert np.abs(K.kinematics.tau[:3] - tau).max() < 1e-12 * tau.max() and tau.min() > 0.1
