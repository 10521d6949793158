"""What disturbs a torque arm's joint is a torque, and what corrects one joint throws no other about."""

import numpy as np
import pytest

import ftqp
from ftqp.kernel.feedback.disturbance import follow_disturbance
from ftqp.kernel.feedback.sent import send

PANDA = ftqp.robots.load("panda")
DT = 1e-3


@pytest.fixture
def K():
    """The record of a Panda at rest whose rotors are known."""
    planner = ftqp.Planner(PANDA, DT, drive=ftqp.Drive(kind="torque", inertia_error=0.0))
    q = PANDA.neutral
    planner.reset(q)
    for _ in range(5):
        planner.step(q, None, ftqp.Target(pose=PANDA.pose(q)))
    yield planner._session.K


def others_than(f):
    return np.arange(7) != f


@pytest.mark.parametrize("f", range(7))
def test_a_joint_that_does_not_do_what_it_was_to_disturbs_no_other(K, f):
    """The others were sent M_HH a_H + M_Hf a_f, and go by M_HH a_H: d_f = -a_f, d_H = M_HH^-1 M_Hf a_f."""
    M, H = K.feedback.M[:7, :7], others_than(f)
    d = np.zeros(7)
    d[f], d[H] = -3.0, np.linalg.solve(M[np.ix_(H, H)], 3.0 * M[H, f])
    K.feedback.d_hat[:7], K.feedback.tau_slow[:7], K.learned.slowness[:7] = d, 0.0, 0.5
    for _ in range(100):
        follow_disturbance(K)
    assert K.feedback.tau_slow[:7][H] == pytest.approx(np.zeros(6), abs=1e-12)
    assert K.feedback.tau_slow[f] == pytest.approx(-3.0 / np.linalg.inv(M)[f, f], rel=1e-9)


@pytest.mark.parametrize("f", range(7))
def test_what_a_correction_asks_beyond_a_max_is_left_to_the_joints_own_motor(K, f):
    """A joint that is far off moves its own torque by 1/(M^-1)_ff of that, and no other's."""
    feedback, tau = K.feedback, {}
    M, a_max = feedback.M[:7, :7].copy(), PANDA.limits.a_max[f]
    for far in (1.0, 1.5):
        feedback.d_hat[:7] = feedback.tau_slow[:7] = 0.0
        K.state.a_command[:7] = 0.0
        feedback.q_now[:7], feedback.v_now[:7] = K.state.q[:7], K.state.v[:7]
        feedback.v_now[f] -= far * a_max / feedback.stiffness  # its correction is 2 far a_max
        send(K)
        tau[far] = feedback.tau_sent[:7].copy()
    more = tau[1.5] - tau[1.0]
    assert more[others_than(f)] == pytest.approx(np.zeros(6), abs=1e-9)
    assert more[f] == pytest.approx(a_max / np.linalg.inv(M)[f, f], rel=1e-9)
