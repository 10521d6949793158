"""How a joint comes to rest: as fast as asked, within its limits, and with a jerk limit where one is set."""

import numpy as np
import pytest
from records import empty_record, formula

from ftqp.kernel.judge import coming_to_rest
from ftqp.kernel.layout.enums import ACCELERATION, VELOCITY

DT = 0.004
deceleration = formula(coming_to_rest.deceleration)


@pytest.mark.parametrize(("v", "expected"), [(0.1, -2.0), (-0.1, 2.0), (1.0, -8.0), (-1.0, 8.0), (0.0, 0.0)])
@pytest.mark.parametrize("rise", [0.0, DT])
def test_without_a_jerk_limit_a_joint_is_braked_by_its_speed_over_the_time_up_to_its_limit(v, expected, rise):
    assert deceleration(v, 3.0, 8.0, 0.05, rise, DT) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("v", [0.02, 0.3, -0.9])
@pytest.mark.parametrize("rise", [2.0 * DT, 0.04, 0.2])
def test_with_a_jerk_limit_a_joint_rests_without_a_jolt_and_never_turns_round(v, rise):
    a_max, side = 8.0, np.sign(v)
    jerk, a, begun, ticks = a_max / rise, 0.0, v, 0
    while v != 0.0:
        before, a = a, deceleration(v, a, a_max, DT, rise, DT)
        assert abs(a) <= a_max * (1.0 + 1e-12) and side * a <= 0.0
        v = 0.0 if abs(v + DT * a) < 1e-12 else v + DT * a
        assert side * v >= 0.0
        last = 9.0 / 8.0 if v == 0.0 else 1.0  # the last tick ends at rest exactly
        assert abs(a - before) <= last * jerk * DT * (1.0 + 1e-6)
        ticks += 1
        assert ticks < 1000
    assert abs(a) <= jerk * DT, "it ends with hardly any deceleration"
    quick = abs(begun) / a_max + 2.0 * np.sqrt(abs(begun) / jerk) + rise
    assert DT * ticks <= quick + 6.0 * DT


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_still_speeds_a_joint_up_ends_at_once(side):
    jerk = 8.0 / 0.04
    assert side * deceleration(side * 0.3, side * 7.0, 8.0, DT, 0.04, DT) == pytest.approx(-jerk * DT)
    assert side * deceleration(side * 0.3, -side * 4.0, 8.0, DT, 0.04, DT) == pytest.approx(-4.0 - jerk * DT)


@pytest.mark.parametrize("level", [ACCELERATION, VELOCITY])
def test_the_objective_draws_working_joints_to_rest_and_free_ones_hardly(level):
    K = empty_record()
    K.chain.n, K.state.level, K.state.dt, K.qp.dense = 4, level, DT, 1
    K.faults.order[:4], K.faults.working, K.faults.movable = [0, 3, 1, 2], 2, 3  # 1 swings free, 2 is locked
    K.limits.a_max[:4] = 8.0
    v = np.array([0.02, -0.3, 0.4, -0.5])
    K.state.v[:4] = v
    formula(coming_to_rest.draw_to_rest)(K, 0.05, 0.0, 2.5)
    H, g = K.qp.H_diagonal[:4], K.qp.g[:4]
    assert K.qp.dense == 0
    share = np.where(np.arange(4) == 1, coming_to_rest.FREE_SHARE, 1.0)
    assert np.allclose(H, 2.5 * share, rtol=1e-15)
    rest = -g / H  # where the objective is least
    a = -np.sign(v) * np.minimum(np.abs(v) / 0.05, 8.0)
    wanted = a if level == ACCELERATION else v + DT * a
    wanted[1:3] = 0.0 if level == ACCELERATION else v[1:3]
    assert np.allclose(rest, wanted, rtol=1e-12)
