"""When an arm that goes to and fro beside a target that stands counts as swinging; logs tick by tick."""

from math import inf

import numpy as np
import pytest
from failing_arm import BEGIN, SIGMA, detector, reference
from records import believe, empty_record

from ftqp.kernel.calm import swing
from ftqp.kernel.detection.detecting import FOUND

N, DT = 3, 0.01


def standing(moves, seconds, stood=2.0):
    """A record whose arm moved so, q(t), beside a target that stood."""
    K = empty_record()
    K.chain.n, K.state.dt = N, DT
    believe(K)
    K.limits.v_max[:N] = [1.0, inf, 2.0]
    for k in range(round(seconds / DT)):
        t = DT * k
        K.state.q[:N], K.state.v[:N] = moves(t), (moves(t + 1e-6) - moves(t - 1e-6)) / 2e-6
        K.calm.stood = stood
        swing.watch_swing(K)
    return K


def to_and_fro(size):
    return lambda t: size * np.sin(2.0 * np.pi * 4.0 * t) * np.array([1.0, 0.0, -1.0])


def test_an_arm_that_goes_to_and_fro_for_two_windows_has_swung_twice_and_gives_up():
    assert standing(to_and_fro(0.05), 0.95).calm.hushed == 0, "not before a window is over"
    K = standing(to_and_fro(0.05), 1.1)
    assert K.calm.hushed == 1 and not swing.gives_up(K)
    K = standing(to_and_fro(0.05), 2.2)
    assert K.calm.hushed == 2 and swing.gives_up(K)
    assert standing(to_and_fro(0.05), 4.5).calm.hushed == 2, "it is looked at no more"


def test_a_swing_that_takes_seconds_is_seen_over_four_of_them():
    def slowly(t):
        return np.array([0.0, 0.3, -0.3]) * (t if t < 2.0 else 4.0 - t)  # no second of it is a swing

    assert standing(slowly, 3.95).calm.hushed == 0
    K = standing(slowly, 4.1)
    assert K.calm.hushed == 1 and K.calm.window < 0.2, "it is looked at anew from there on"
    assert standing(lambda t: slowly(t) + 0.5 * t, 4.1).calm.hushed == 0, "it gets somewhere all the same"


def test_an_arm_that_gets_somewhere_or_hardly_moves_does_not_swing():
    assert standing(lambda t: t * np.array([0.1, 0.2, -0.1]), 3.1).calm.hushed == 0
    assert standing(to_and_fro(1e-4), 3.1).calm.hushed == 0
    assert standing(to_and_fro(0.05), 3.1, stood=0.9).calm.hushed == 0, "it still arrives"


def test_what_joints_that_failed_do_is_no_swing():
    K = empty_record()
    K.chain.n, K.state.dt, K.calm.stood = N, DT, 2.0
    believe(K, {0: 1, 2: 1})
    K.limits.v_max[:N] = 1.0
    for k in range(250):
        K.state.q[:N] = to_and_fro(0.05)(DT * k)
        K.state.v[:N] = (to_and_fro(0.05)(DT * k + 1e-6) - K.state.q[:N]) / 1e-6
        swing.watch_swing(K)
    assert K.calm.hushed == 0


def test_a_target_that_moves_lets_it_be_forgotten():
    K = standing(to_and_fro(0.05), 2.2)
    K.calm.stood = 0.0
    swing.watch_swing(K)
    assert K.calm.hushed == 0 and K.calm.window == 0.0


@pytest.mark.parametrize("drive", ["position", "torque"])
def test_a_log_is_looked_at_as_tick_by_tick_and_up_to_the_answer_that_was_asked_for(drive):
    """Findings, z and the largest excess of each block of rows."""
    rows, block, at = 90, 30, 60
    rng = np.random.default_rng(4)
    ahead = [reference(BEGIN + k + 1) for k in range(rows)]
    columns = {
        "q": np.array([reference(BEGIN + k)[0] for k in range(rows)])
        + SIGMA * rng.standard_normal((rows, 3)),
        "q_ref": np.array([q for q, _, _ in ahead]),
        "v_ref": np.array([v for _, v, _ in ahead]),
        "a_ref": np.array([a for _, _, a in ahead]),
        "tau": None,
        "effort": np.full((rows, 3), 0.5) if drive == "torque" else None,
    }
    columns["q"][at:, 1] += 0.05
    one, other = detector(drive)._session, detector(drive)._session
    done, peaks, trace = one.run(columns, block)
    tick, nothing = other.detect(), np.zeros(0)
    highest = np.zeros((rows // block, *other.D.peak.shape))
    codes = []
    for k in range(rows):
        effort = nothing if columns["effort"] is None else columns["effort"][k]
        codes.append(
            tick(
                columns["q"][k], nothing, *(columns[name][k] for name in ("q_ref", "v_ref", "a_ref")), effort
            )
        )
        assert trace[k] == other.D.worst
        if (k + 1) % block == 0:
            highest[k // block] = other.D.peak
            other.D.peak[:] = 0.0
    assert done == rows and np.array_equal(peaks[:, :, :3], highest[:, :, :3])
    assert np.array_equal(one.D.kinds, other.D.kinds) and one.D.kinds[1] != 0
    until = detector(drive)._session.run(columns, block, FOUND)[0]
    assert until == codes.index(FOUND) + 1 == at + 3
