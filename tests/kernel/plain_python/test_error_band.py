"""Who is out of hand, tick by tick, and what the others no longer answer for."""

import numpy as np
import pytest
from records import empty_record

from ftqp.kernel.feedback import error_band, monitor
from ftqp.kernel.layout.enums import HEALTHY, LOCKED, STOPPED_BY_LAG, DriveKind
from ftqp.kernel.layout.hypotheses import TOO_FAST

N = 4
DT = 0.004


def record(kind=DriveKind.POSITION):
    """An arm that rests at its command."""
    K = empty_record()
    K.chain.n, K.state.dt = N, DT
    K.feedback.kind, K.feedback.span, K.feedback.now, K.feedback.latency = kind, 4, 1, 0
    K.feedback.exact, K.feedback.culprit, K.watch.stop_samples = 0, -1, 3
    K.limits.v_max[:N] = 2.0
    K.faults.order[:N], K.faults.working, K.faults.movable = range(N), N, N
    return K


def look(K):
    """A tick of the monitor, as far as it looks at the motion of joints."""
    if not K.feedback.exact or K.feedback.any_counted:
        monitor.watch_motion(K)


def ticks_until_asked(K, most=60):
    """How many ticks it takes until a joint asks for its brake, and which; None if none does."""
    for k in range(most):
        look(K)
        if K.feedback.asks[:N].any():
            return k + 1, K.feedback.asks[:N].nonzero()[0].tolist()
    return None, []


@pytest.mark.parametrize(("kind", "ticks"), [(DriveKind.POSITION, 25), (DriveKind.TORQUE, 3)])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_joint_faster_than_asked_and_allowed_asks_after_its_time(kind, ticks, side):
    """100 ms with a servo; 10 ms, 2.5 ticks, without."""
    for share, expected in ((1.21, (ticks, [2])), (1.19, (None, []))):
        K = record(kind)
        K.feedback.v_hat[2] = side * share * 2.0
        assert ticks_until_asked(K) == expected
        assert K.feedback.any_counted == (expected[0] is not None)
        assert (K.watch.latched, K.feedback.culprit) == ((1, 2) if expected[0] else (0, -1))
        assert K.watch.reason == (STOPPED_BY_LAG if expected[0] else 0)


def test_what_is_asked_beyond_the_limit_is_no_overspeed():
    for share, asked in ((1.15, None), (1.25, 25)):
        K = record()
        K.past.v[1, 0], K.feedback.v_hat[0] = -3.0, share * 3.0 - (share - 1.2) * 1.0
        K.feedback.v_hat[0] = 3.0 + (share - 1.0) * 2.0
        assert ticks_until_asked(K)[0] == asked


@pytest.mark.parametrize("what", ["no emergency stop", "already stopped"])
def test_a_joint_out_of_hand_stops_the_arm_once_and_only_where_it_may(what):
    K = record()
    K.feedback.v_hat[0] = 3.0
    K.watch.latched = 1 if what == "already stopped" else 0
    K.watch.stop_samples = 0 if what == "no emergency stop" else 3
    K.watch.reason = 5 if what == "already stopped" else 0
    before = (int(K.watch.latched), int(K.watch.reason))
    assert ticks_until_asked(K) == (25, [0])
    assert (K.watch.latched, K.watch.reason) == before and K.feedback.culprit == -1


@pytest.mark.parametrize(("v", "sigma"), [(0.0, 0.0), (-0.5, 0.0), (0.0, 1e-3)])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_in_a_stop_the_error_band_is_two_hundredths_six_sigmas_and_a_tenth_of_a_second_of_the_command(
    v, sigma, side
):
    band = 0.02 + 6.0 * sigma + 0.1 * abs(v)
    for share, expected in ((1.01, (5, [3])), (0.99, (None, []))):
        K = record()
        K.watch.latched, K.feedback.sigma = 1, sigma
        K.past.v[1, 3], K.past.q[1, 3], K.feedback.seen[3] = v, 0.7, 0.7 + side * share * band
        assert error_band.error_band(K.feedback, K.past, 3) == pytest.approx(band)
        assert ticks_until_asked(K) == expected
        K.watch.latched = 0
        K.feedback.asks[:] = 0
        assert ticks_until_asked(K) == (None, []), "while it is led, a joint beside its command only lags"


@pytest.mark.parametrize("what", ["v_hat", "seen"])
def test_one_tick_in_order_begins_the_count_anew(what):
    K = record(DriveKind.TORQUE)
    K.watch.latched = 1
    away = (3.0, 2) if what == "v_hat" else (0.5, 4)
    for _ in range(5):
        for value in (*[away[0]] * away[1], 0.0):
            K.feedback[what][1] = value
            look(K)
            assert K.feedback.any_counted == (value != 0.0)
    assert not K.feedback.asks[:N].any()


def test_samples_of_the_past_are_compared_with_the_command_of_their_time():
    K = record()
    K.watch.latched, K.feedback.latency = 1, 2
    K.past.q[3, 1] = K.feedback.seen[1] = 0.5  # two ticks before place 1 of a ring of four
    assert ticks_until_asked(K) == (None, [])
    K.past.q[3, 1], K.past.q[1, 1] = 0.0, 0.5
    assert ticks_until_asked(K) == (5, [1])


def test_failed_joints_are_not_looked_at_and_an_arm_that_follows_exactly_not_at_all():
    K = record()
    K.faults.code[:N] = [LOCKED, HEALTHY, LOCKED, HEALTHY]
    K.feedback.v_hat[:N], K.feedback.lasting[TOO_FAST, 0] = [5.0, 0.0, 5.0, 5.0], 30
    assert ticks_until_asked(K) == (25, [3])
    assert K.feedback.lasting[TOO_FAST, 0] == 0 == K.feedback.lasting[TOO_FAST, 2]
    K = record()
    K.feedback.exact, K.feedback.v_hat[1] = 1, 5.0
    assert ticks_until_asked(K) == (None, [])
    K.feedback.any_counted = 1  # some joint was counted a tick ago
    look(K)
    assert K.feedback.lasting[TOO_FAST, 1] == 1


@pytest.mark.parametrize("f", [0, 2, 3])
def test_what_a_failed_joint_did_not_do_is_no_disturbance_of_the_others(f):
    """M_HH d_H = -M_Hf d_f is taken back, and what was sent to them lately counts as so much less."""
    K, rng = record(DriveKind.TORQUE), np.random.default_rng(f)
    M = rng.normal(size=(N, N))
    M = M @ M.T + np.eye(N)
    others = [i for i in range(N) if i not in (f, 1)]  # joint 1 has failed before
    K.faults.order[:N], K.faults.working = [*sorted([*others, f]), 1], 3
    K.feedback.M[:N, :N], K.feedback.latency = M, 1
    d, slow, a = rng.normal(size=N), rng.normal(size=N), rng.normal(size=(4, N))
    K.feedback.d_hat[:N], K.feedback.d_slow[:N], K.past.a[:4, :N] = d, slow, a
    error_band.part_with(K, f)
    column = np.zeros(N)
    column[others] = np.linalg.solve(M[np.ix_(others, others)], M[others, f])
    assert np.allclose(K.feedback.d_hat[:N], d + column * d[f], atol=1e-12)
    assert np.allclose(K.feedback.d_slow[:N], slow + column * slow[f], atol=1e-12)
    lately = np.array([[1.0], [1.0], [0.0], [1.0]])  # places 1, 0 and 3: of three ticks
    assert np.allclose(K.past.a[:4, :N], a - lately * column * d[f], atol=1e-12)


def test_without_an_inertia_that_can_be_solved_nothing_is_taken_back():
    K = record(DriveKind.TORQUE)
    K.feedback.M[:N, :N], K.feedback.d_hat[:N] = -np.eye(N), 1.0
    error_band.part_with(K, 1)
    assert K.feedback.d_hat[:N].tolist() == [1.0] * N
