"""Who is out of hand, tick by tick, and what the others no longer answer for."""

import numpy as np
import pytest
from records import empty_record

from ftqp.kernel.feedback import error_band, monitor
from ftqp.kernel.layout.enums import STOPPED_BY_LAG, DriveKind

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


def test_samples_of_the_past_are_compared_with_the_command_of_their_time():
    K = record()
    K.watch.latched, K.feedback.latency = 1, 2
    K.past.q[3, 1] = K.feedback.seen[1] = 0.5  # two ticks before place 1 of a ring of four
    assert ticks_until_asked(K) == (None, [])
    K.past.q[3, 1], K.past.q[1, 1] = 0.0, 0.5
    assert ticks_until_asked(K) == (5, [1])


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
