"""Which limits count as not kept, and by how much, against plain numpy."""

import numpy as np
import pytest
from records import empty_record, formula

from ftqp.kernel.judge import kept_limits
from ftqp.kernel.layout.enums import FREE, HEALTHY, LOCKED, JointCode
from ftqp.kernel.layout.thresholds import OUTSIDE_FROM

N = 8


def arm(codes=(HEALTHY,) * N):
    """A record of an arm well inside its limits, joint by joint different."""
    K = empty_record()
    K.chain.n = N
    K.faults.code[:N] = codes
    K.limits.q_min[:N], K.limits.q_max[:N] = -1.0 - 0.1 * np.arange(N), 2.0 + 0.1 * np.arange(N)
    K.limits.v_max[:N], K.limits.tau_max[:N] = 1.5, np.inf
    return K


@pytest.mark.parametrize("joint", [0, 3, 6])
@pytest.mark.parametrize("end", ["q_min", "q_max"])
@pytest.mark.parametrize("code", [HEALTHY, LOCKED, FREE])
def test_a_joint_is_outside_beyond_a_millionth_past_its_end_whether_it_works_or_not(joint, end, code):
    for share, outside in ((0.9, 0), (1.1, 1)):
        K = arm([code if i == joint else HEALTHY for i in range(N)])
        side = 1.0 if end == "q_max" else -1.0
        K.state.q[joint] = K.limits[end][joint] + side * share * OUTSIDE_FROM
        assert kept_limits.joints_outside(K) == outside
        assert formula(kept_limits.is_beyond_range)(K, joint) == bool(outside)
        assert not formula(kept_limits.is_beyond_range)(K, (joint + 1) % N)
        K.state.q[joint] = K.limits[end][joint] + side * OUTSIDE_FROM
        assert not formula(kept_limits.is_beyond_range)(K, joint), "a millionth is none"


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("code", [HEALTHY, LOCKED])
def test_a_joint_that_works_is_outside_when_a_millionth_too_fast(side, code):
    for share, fast in ((0.9, False), (1.1, True)):
        K = arm([code if i == 4 else HEALTHY for i in range(N)])
        K.state.v[4] = side * 1.5 * (1.0 + share * OUTSIDE_FROM)
        assert formula(kept_limits.is_too_fast)(K, 4) == fast
        assert kept_limits.joints_outside(K) == (fast and code == HEALTHY)


def test_each_joint_outside_is_counted_once():
    rng = np.random.default_rng(2)
    for _ in range(60):
        codes = rng.choice([int(code) for code in JointCode], N)
        K = arm(codes)
        K.state.q[:N] = rng.uniform(-2.5, 3.5, N)
        K.state.v[:N] = rng.uniform(-2.0, 2.0, N)
        beyond = (K.state.q[:N] < K.limits.q_min[:N]) | (K.state.q[:N] > K.limits.q_max[:N])
        fast = (np.abs(K.state.v[:N]) > 1.5) & (codes == HEALTHY)
        assert kept_limits.joints_outside(K) == np.sum(beyond | fast)
    for side in (1.0, -1.0):
        K = arm()
        K.state.q[:N] = 4.0 * side
        assert kept_limits.joints_outside(K) == N


def test_torque_excess_is_the_worst_of_motors_and_of_what_swings_free():
    rng = np.random.default_rng(4)
    met = set()
    for _ in range(80):
        codes = rng.choice([HEALTHY, FREE, LOCKED], N, p=[0.6, 0.25, 0.15])
        K = arm(codes)
        K.limits.tau_max[:N] = rng.uniform(0.5, 3.0, N)
        K.state.tau[:N], K.state.a_command[:N] = rng.normal(size=(2, N)) * 2.0
        K.state.v[:N], K.state.v_command[:N] = rng.normal(size=(2, N))
        K.kinematics.h[:N], K.kinematics.M[:N, :N] = rng.normal(size=N), rng.normal(size=(N, N))
        K.faults.friction[:N], K.faults.coulomb[:N] = rng.uniform(0.0, 1.0, (2, N))
        K.chain.viscous[:N] = rng.uniform(0.0, 1.0, N)
        K.free.contact[:N] = rng.random(N) < 0.3
        motors = np.abs(K.state.tau[:N]) - K.limits.tau_max[:N]
        dv = K.state.v_command[:N] - K.state.v[:N]
        swung = K.kinematics.h[:N] + K.kinematics.M[:N, :N] @ K.state.a_command[:N]
        swung += K.faults.friction[:N] * K.state.v_command[:N] + K.chain.viscous[:N] * dv
        free = np.abs(swung) - K.faults.coulomb[:N]
        every = np.where(
            codes == HEALTHY, motors, np.where((codes == FREE) & ~K.free.contact[:N].astype(bool), free, 0)
        )
        met.add(int(codes[np.argmax(every)]))
        assert formula(kept_limits.torque_excess)(K) == pytest.approx(max(every.max(), 0.0), abs=1e-12)
    assert met >= {HEALTHY, FREE}
    K = arm()
    K.limits.tau_max[:N], K.state.tau[:N] = 1.0, -0.5
    assert formula(kept_limits.torque_excess)(K) == 0.0
