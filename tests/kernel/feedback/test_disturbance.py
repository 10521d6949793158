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


def sent_when_off(K, f, far):
    """The torques that are sent when joint f is so much too fast that its correction is -far a_max."""
    feedback = K.feedback
    feedback.d_hat[:7] = feedback.tau_slow[:7] = K.state.a_command[:7] = 0.0
    feedback.q_now[:7], feedback.v_now[:7] = K.state.q[:7], K.state.v[:7]
    feedback.v_now[f] += far * PANDA.limits.a_max[f] / (2.0 * feedback.stiffness)
    send(K)
    return feedback.tau_sent[:7].copy()


@pytest.mark.parametrize("f", range(7))
@pytest.mark.parametrize("far", [1.2, 2.0, 3.0])
def test_a_correction_beyond_a_max_moves_its_joint_and_asks_the_others_for_a_max_at_most(K, f, far):
    """The joint gets all of it whether they go along or not: x_f = (M^-1 c)_f; each c_h is bounded."""
    M, a_max = K.feedback.M[:7, :7].copy(), PANDA.limits.a_max
    most = 0.6 * PANDA.limits.tau_max[f] / M[f, f] / a_max[f]
    more = sent_when_off(K, f, far) - sent_when_off(K, f, 1.0)
    x = np.linalg.solve(M, more)
    assert x[f] == pytest.approx(-(min(far, most) - min(1.0, most)) * a_max[f], rel=1e-9, abs=1e-12)
    H = others_than(f)
    go_along = np.clip(M[H, f] * x[f], -(a_max * np.diag(M))[H], (a_max * np.diag(M))[H])
    assert more[H] == pytest.approx(go_along, rel=1e-9, abs=1e-12)


def test_a_correction_of_a_heavy_joint_does_not_throw_a_light_one(K):
    """A Panda's wrist would be asked for more than a_max beside joint 4 that asks for three times its own."""
    M, a_max = K.feedback.M[:7, :7].copy(), PANDA.limits.a_max
    asked = abs(M[5, 3]) * 2.0 * a_max[3] / M[5, 5]
    assert asked > a_max[5]
    more = sent_when_off(K, 3, 3.0) - sent_when_off(K, 3, 1.0)
    assert abs(more[5]) == pytest.approx(a_max[5] * M[5, 5], rel=1e-9)
