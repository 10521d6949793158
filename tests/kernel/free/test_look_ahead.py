"""The look-ahead's plan: what is tried, when time goes on, and what a rollout says."""

import numpy as np
import pytest
from records import believe, chain_record

import ftqp
from ftqp.kernel.entry.session import rooms
from ftqp.kernel.free.look_ahead import (
    _later_impact,
    begin_plan,
    look_ahead,
    planned,
    search,
    try_another,
)
from ftqp.kernel.free.swinging import see_arm
from ftqp.kernel.layout.enums import FREE
from ftqp.kernel.layout.record import dtype


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


def test_every_other_value_is_tried_once_in_a_round():
    K, F = falling()
    search(K, F)
    seen = []
    F.best = -1e9  # nothing is better
    for _ in range(3 * 6 * 3):
        before = F.plan[:, :7].copy()
        at = int(F.candidate)
        try_another(K, F)
        assert np.array_equal(F.plan[:, :7], before)
        seen.append(at)
    assert sorted(seen) == list(range(54)) and F.candidate == 0


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


@pytest.mark.parametrize("seed", [0, 2, 6, 11])  # no impact; a slow one, two fast ones
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
