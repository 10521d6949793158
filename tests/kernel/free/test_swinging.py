"""A step of a rollout against pinocchio, the stop, and friction."""

import numpy as np
import pinocchio as pin
import pytest
from records import believe, chain_record

import ftqp
from ftqp.kernel.commands.believed import LEAST_SAMPLES, WINDOW, window_ticks
from ftqp.kernel.entry.session import rooms
from ftqp.kernel.free.foretelling import left_by_a_line
from ftqp.kernel.free.look_ahead import (
    _later_impact,
    begin_plan,
    look_ahead,
    planned,
    search,
)
from ftqp.kernel.free.swinging import free_velocity, see_arm, swing_on
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
        see_arm(K)
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


def test_friction_slows_a_joint_that_slides():
    free, with_friction = (free_velocity(0.5, 1.0 - 0.6, 2.0, 0.3, mu, STEP) for mu in (0.0, 2.0))
    assert abs(free - (2.0 + STEP * (1.0 - 0.6) / 0.503)) < 1e-14
    assert abs(with_friction - (free - STEP * 2.0 / 0.503)) < 1e-14


def falling(joint=1):
    """A Panda whose second joint has begun to fall; (K, F)."""
    robot = ftqp.robots.load("panda")
    K, F = chain_record(robot), rooms(np.zeros(1, dtype("free", 8)))
    for name in ("q_min", "q_max", "v_max", "a_max", "tau_max"):
        getattr(K.limits, name)[:7] = getattr(robot.limits, name)
    K.limits.a_brake[:7] = robot.limits.a_max
    believe(K, {joint: FREE})
    F.joint, F.dt, F.period, F.left = joint, 1e-3, 5, 1.0
    F.held_reach = np.inf  # however far links go
    F.q[:7] = robot.neutral
    F.q[1] = 0.4
    begin_plan(F, 7)
    return K, F


def test_search_softens_the_impact_that_braking_would_have():
    K, F = falling()
    search(K, F)
    first = float(F.best)
    assert K.free.impact_speed > 2.0 and K.free.impact_side != 0
    for _ in range(54):  # formulas are plain Python here: no more of them than it takes
        search(K, F)
        if F.best < 0.8 * first:
            return
    raise AssertionError(f"{F.best} after a whole round, {first} at first")


def test_joint_near_its_limit_is_not_driven_further():
    K, F = falling()
    K.state.q[0], K.state.v[0] = K.limits.q_max[0] - 1e-3, 0.0
    F.plan[0, 0] = 1.0
    a = planned(K.state, K.limits, F, 0, 0.0, 1.0, 0.01)
    assert 0.0 <= a < K.limits.a_max[0] and 0.5 * a * 0.01**2 <= 1e-3


@pytest.mark.parametrize("seed", [0, 6])  # no impact; a fast one
def test_what_comes_later_is_what_a_rollout_of_the_whole_arm_says(seed):
    rng = np.random.default_rng(seed)
    joint = int(rng.integers(1, 6))
    K, F = falling(joint)
    K.faults.friction[joint] = rng.uniform(0.5, 5.0)
    q = rng.uniform(0.8 * K.limits.q_min[:7], 0.8 * K.limits.q_max[:7])
    F.base_q[:7], F.base_v[:7] = q, 0.0
    look_ahead(K, F, 0.0, 0.0, 1e300, 400)  # 4 s; all others stand
    whole = float(F.impact_speed)
    K.supposed.q[:7], K.supposed.v[:7] = q, 0.0
    see_arm(K)
    later = _later_impact(K, F)
    assert (whole > 0.0) == (later > 0.0)
    assert later == pytest.approx(whole, rel=0.05, abs=0.02)


@pytest.mark.parametrize("samples", [LEAST_SAMPLES, 50])
def test_line_leaves_what_a_fit_by_numpy_leaves(samples):
    rng = np.random.default_rng(samples)
    t = 1e-3 * np.arange(1, samples + 1)
    y = 0.3 - 2.0 * t + 40.0 * t**2 + 1e-4 * rng.standard_normal(samples)
    sums = np.array([y.sum(), (t * y).sum(), (y**2).sum()])
    left = np.polyfit(t, y, 1, full=True)[1][0]
    assert left_by_a_line(sums, samples, 1e-3) == pytest.approx(left, rel=1e-6)


@pytest.mark.parametrize("dt", [2e-4, 1e-3, 2e-3, 1e-2, 5e-2])
def test_window_is_fifty_milliseconds_or_eight_samples(dt):
    assert window_ticks(dt) == max(8, round(WINDOW / dt))
