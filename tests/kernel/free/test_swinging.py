"""A step of a rollout against pinocchio, the stop, and friction."""

import numpy as np
import pinocchio as pin
import pytest
from records import believe, chain_record

import ftqp
from ftqp.kernel.entry.session import rooms
from ftqp.kernel.free.swinging import swing_on, sync_model
from ftqp.kernel.layout.enums import FREE
from ftqp.kernel.layout.record import dtype

STEP = 0.01


@pytest.fixture
def arm():
    """A Panda, its joint ``i`` free, at (q, v) with the accelerations a; (K, F)."""

    def made(i, q, v, a, damping=0.0, coulomb=0.0):
        robot = ftqp.robots.load("panda")
        K, F = chain_record(robot), rooms(np.zeros(1, dtype("free", 8)))
        limits = robot.limits
        for name in ("q_min", "q_max", "v_max", "a_max", "tau_max"):
            getattr(K.limits, name)[:7] = getattr(limits, name)
        believe(K, {i: FREE})
        K.faults.friction[i], K.faults.coulomb[i] = damping, coulomb
        K.supposed.q[:7], K.supposed.v[:7], F.a[:7], F.joint = q, v, a, i
        sync_model(K)
        return K, F

    return made


@pytest.mark.parametrize("joint", range(7))
def test_free_joint_gets_the_torque_of_its_friction_and_the_others_their_accelerations(arm, joint):
    rng = np.random.default_rng(joint)
    robot = ftqp.robots.load("panda")
    q, v, a = robot.neutral.copy(), rng.uniform(-1.0, 1.0, 7), rng.uniform(-3.0, 3.0, 7)
    K, F = arm(joint, q, v, a, damping=0.7)
    impact, share = swing_on(K.supposed, K.faults, K.limits, K.kinematics, K.chain, F, STEP)
    after = K.supposed.v[:7].copy()
    tau = pin.rnea(robot.model, robot.model.createData(), q, v, (after - v) / STEP)
    assert impact == 0.0
    assert abs(tau[joint] + 0.7 * after[joint]) < 1e-11 * np.abs(tau).max()
    healthy = np.arange(7) != joint
    assert np.allclose(((after - v) / STEP)[healthy], a[healthy], rtol=0, atol=1e-10)
    assert np.allclose(K.supposed.q[:7], q + STEP * after, rtol=0, atol=1e-14)
    assert abs(share - (np.abs(tau) / robot.limits.tau_max)[healthy].max()) < 1e-10


@pytest.mark.parametrize("side", [-1, 1])
def test_joint_stops_where_it_meets_its_stop_and_rests_there(arm, side):
    robot = ftqp.robots.load("panda")
    q, v = robot.neutral.copy(), np.zeros(7)
    stop = robot.limits.q_max[3] if side > 0 else robot.limits.q_min[3]
    q[3], v[3] = stop - side * 0.005, side * 2.0
    K, F = arm(3, q, v, np.zeros(7))
    impact, _ = swing_on(K.supposed, K.faults, K.limits, K.kinematics, K.chain, F, STEP)
    assert 1.5 < impact < 2.5 and K.supposed.q[3] == stop and K.supposed.v[3] == 0.0
