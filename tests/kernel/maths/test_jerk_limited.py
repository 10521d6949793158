"""Motions to rest with limited jerk end where they shall, within their limits, as soon as ruckig's."""

import numpy as np
import pytest
import ruckig

from ftqp.kernel.maths.jerk_limited import PARTS, brake, duration_of, fastest, slower, state_after


def drawn(rng):
    """A way, a speed, an acceleration, and their limits."""
    v_max, a_max, jerk = rng.uniform(0.2, 3.0), rng.uniform(1.0, 15.0), rng.uniform(20.0, 500.0)
    v, a = rng.uniform(-1.0, 1.0, 2) * (v_max, a_max) * rng.integers(0, 2, 2)
    return rng.uniform(-3.0, 3.0) * rng.choice([0.01, 0.1, 1.0]), v, a, v_max, a_max, jerk


def parts():
    return np.zeros(PARTS), np.zeros(PARTS)


def by_ruckig(way, v, a, v_max, a_max, jerk):
    given, found = ruckig.InputParameter(1), ruckig.Trajectory(1)
    given.current_position, given.current_velocity, given.current_acceleration = [0.0], [v], [a]
    given.target_position, given.max_velocity = [way], [v_max]
    given.max_acceleration, given.max_jerk = [a_max], [jerk]
    ruckig.Ruckig(1).calculate(given, found)
    return found.duration


@pytest.mark.parametrize("seed", range(100))
def test_the_fastest_motion_ends_at_rest_at_its_place_and_keeps_every_limit(seed):
    way, v, a, v_max, a_max, jerk = drawn(np.random.default_rng(seed))
    times, jerks = parts()
    fastest(times, jerks, way, v, a, v_max, a_max, jerk)
    T = duration_of(times)
    np.testing.assert_allclose(state_after(times, jerks, T, v, a), (way, 0.0, 0.0), atol=1e-9)
    stays = abs(v + 0.5 * a * abs(a) / jerk) <= v_max  # else it is too fast before it can be slower
    for t in np.linspace(0.0, T, 50):
        _, now, pull = state_after(times, jerks, t, v, a)
        assert abs(pull) <= a_max * (1.0 + 1e-9)
        assert not stays or abs(now) <= v_max * (1.0 + 1e-9)


def test_of_a_hundred_motions_ninety_eight_are_as_fast_as_those_of_ruckig_and_none_much_slower():
    later = []
    for seed in range(500):
        way, v, a, v_max, a_max, jerk = drawn(np.random.default_rng(seed))
        times, jerks = parts()
        fastest(times, jerks, way, v, a, v_max, a_max, jerk)
        if abs(v + 0.5 * a * abs(a) / jerk) <= v_max:
            later.append(duration_of(times) - by_ruckig(way, v, a, v_max, a_max, jerk))
    assert min(later) > -1e-6 and np.quantile(later, 0.98) < 1e-6 and max(later) < 0.1


@pytest.mark.parametrize("seed", range(100))
def test_a_motion_that_takes_longer_arrives_at_the_time_that_is_asked_for(seed):
    rng = np.random.default_rng(seed)
    way, v, a, *limits = drawn(rng)
    times, jerks = parts()
    w = fastest(times, jerks, way, v, a, *limits)
    T = duration_of(times) * rng.uniform(1.0, 3.0)
    slower(times, jerks, way, v, a, w, *limits[1:], T)
    assert duration_of(times) == pytest.approx(T, abs=1e-9)
    np.testing.assert_allclose(state_after(times, jerks, T, v, a), (way, 0.0, 0.0), atol=1e-8)


def test_a_state_beyond_the_limits_is_brought_within_them_first():
    times, jerks = parts()
    way = brake(times, jerks, 2.0, 12.0, 5.0, 100.0)
    pulls = [state_after(times, jerks, t, 2.0, 12.0)[2] for t in np.linspace(0.0, duration_of(times), 200)]
    assert pulls[0] == 12.0 and min(pulls) >= -5.0 * (1.0 + 1e-9) and np.diff(pulls).max() <= 1.0
    assert state_after(times, jerks, 9.0, 2.0, 12.0) == pytest.approx((way, 0.0, 0.0), abs=1e-12)
