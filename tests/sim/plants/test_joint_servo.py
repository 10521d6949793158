"""The torques of joint servos against their formula."""

from types import SimpleNamespace

import numpy as np
import pytest

from ftqp.sim.plants.joint_servo import JointServo
from ftqp.sim.plants.plant import Arm

WN = 60.0


@pytest.fixture
def state(panda):
    rng = np.random.default_rng(3)
    q = panda.neutral + 0.2 * rng.standard_normal(panda.nv)
    return q, 0.3 * rng.standard_normal(panda.nv), q + 0.002 * rng.standard_normal(panda.nv)


def asked(panda, drive, state, limit, strays=()):
    """What a servo that is led to q_c asks for, what it wants of its joints, M and h, and the servo."""
    q, v, to = state
    servo, tau = JointServo(panda, drive, bandwidth=WN), np.zeros(panda.nv)
    servo.strays[list(strays)] = 1.0
    servo.take(SimpleNamespace(q=to, v=np.zeros(panda.nv), tau=to))
    servo.torques(q, v, limit, tau)
    a = -WN * v if drive == "velocity" else WN**2 * (to - q) - 2.0 * WN * v
    M, h = Arm(panda).dynamics(q, v)
    return tau, a, M.copy(), h.copy(), servo


@pytest.mark.parametrize("drive", ["position", "velocity"])
def test_servo_asks_for_the_computed_torque(panda, drive, state):
    tau, a, M, h, servo = asked(panda, drive, state, np.full(panda.nv, np.inf))
    np.testing.assert_allclose(tau, M @ a + h, atol=1e-9)
    np.testing.assert_allclose(servo.demand, np.clip(tau, -panda.limits.tau_max, panda.limits.tau_max))


@pytest.mark.parametrize("drive", ["position", "velocity"])
def test_stray_joint_is_asked_by_itself_and_moves_no_other(panda, drive, state):
    tau, a, M, h, _ = asked(panda, drive, state, np.full(panda.nv, np.inf), strays=[2])
    others = np.where(np.arange(panda.nv) == 2, 0.0, a)
    expected = M @ others + h
    expected[2] += M[2, 2] * a[2]
    np.testing.assert_allclose(tau, expected, atol=1e-9)


def test_demand_of_a_motor_that_is_off_is_what_it_would_be_asked_for(panda, state):
    limit = panda.limits.tau_max.copy()
    limit[3] = 0.0
    tau, a, M, h, servo = asked(panda, "position", state, limit)
    others = np.where(np.arange(panda.nv) == 3, 0.0, a)
    assert tau[3] == 0.0
    assert servo.demand[3] == pytest.approx(h[3] + M[3] @ others + M[3, 3] * a[3], abs=1e-9)


def test_demand_of_a_torque_arm_is_what_is_sent(panda, state):
    limit = panda.limits.tau_max.copy()
    limit[1] = 0.0
    tau, _, _, _, servo = asked(panda, "torque", state, limit)
    np.testing.assert_array_equal(servo.demand, state[2])
    assert tau[1] == 0.0 and servo.demand[1] != 0.0
