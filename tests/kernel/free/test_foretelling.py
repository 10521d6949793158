"""The comparison that tells a joint that swings from one that stands or coasts."""

import numpy as np
import pytest

from ftqp.kernel.free.foretelling import BETTER, FALLS, left_by_a_line
from ftqp.kernel.told.measured import LEAST_SAMPLES, WINDOW, window_ticks


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


def test_threshold_is_an_acceleration_of_one_over_the_window():
    t = 1e-3 * np.arange(1, 51)
    y = 0.5 * t**2
    left = np.polyfit(t, y, 1, full=True)[1][0]
    assert np.sqrt(left / 50) == pytest.approx(FALLS, rel=0.1)


def test_friction_up_to_two_fifths_of_the_pull_leaves_the_swing_the_better_guess():
    t = 1e-3 * np.arange(1, 51)

    def left(a):
        return np.polyfit(t, 0.5 * a * t**2, 1, full=True)[1][0]

    pull = 10.0
    assert BETTER * left(0.41 * pull) < left(0.59 * pull)
    assert BETTER * left(0.42 * pull) > left(0.58 * pull)
