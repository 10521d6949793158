import numpy as np
import pytest

from ftqp.sim.log.metrics import EXACT, Counts, Quantiles


def filled(values, pieces=3):
    found = Quantiles()
    for piece in np.array_split(values, pieces):
        found.add(piece)
    return found


def test_quantiles_of_few_numbers_are_those_of_numpy():
    values = np.random.default_rng(0).lognormal(size=5000)
    for percent in (0.0, 50.0, 99.0, 99.9, 100.0):
        assert filled(values).at(percent) == np.percentile(values, percent)


def test_quantiles_of_many_numbers_are_within_a_thousandth():
    values = np.random.default_rng(1).lognormal(mean=3.0, sigma=2.0, size=EXACT + 50_000)
    for percent in (1.0, 50.0, 99.0, 99.9):
        assert filled(values, 7).at(percent) == pytest.approx(np.percentile(values, percent), rel=1e-3)


def test_what_is_no_number_is_left_out_and_nothing_has_no_quantile():
    assert filled(np.array([np.nan, 1.0, np.inf, 3.0])).at(50.0) == 2.0
    assert Quantiles().at(50.0) is None and Counts().median() is None


def test_numbers_beyond_the_bins_are_counted_in_the_last_ones():
    values = np.concatenate([np.zeros(EXACT), np.full(EXACT, 1e30), [-1.0]])
    found = filled(values)
    assert found.count == len(values)
    assert found.at(10.0) < 1e-5 and found.at(90.0) > 1e7


@pytest.mark.parametrize("values", [[3.0], [1.0, 2.0], [5.0, 1.0, 1.0], [2.0, 2.0, 9.0, 4.0]])
def test_median_of_counts_is_that_of_numpy(values):
    found = Counts()
    for value in [*values, np.nan]:
        found.add(np.array([value]))
    assert found.median() == np.median(values)
