"""The probability that a task is finished."""

import numpy as np
import pytest

from ftqp.analysis.survival.mission_survival import mission_survival
from ftqp.core.errors import InputError
from ftqp.model import catalog

ARM = catalog.load("planar", lengths=(1.0, 1.0, 1.0))
T = np.arange(100) * 36.0
END = 3600.0


def test_nothing_survived_leaves_the_chance_of_no_failure() -> None:
    found = mission_survival(ARM, np.zeros((3, 100), dtype=bool), T, END, {"j1": 10.0, 1: 20.0})
    assert np.isclose(found.without, np.exp(-1.0 / 10.0 - 1.0 / 20.0))
    assert found.low == found.likely == found.high == found.without and found.coverage == 0.0


def test_everything_survived_fails_by_a_second_failure_only() -> None:
    hours = {0: 5.0, 1: 10.0, 2: 20.0}
    found = mission_survival(ARM, np.ones((3, 100), dtype=bool), T, END, hours)
    assert np.isclose(found.high, 1.0 - 0.0, atol=1e-2) and found.high <= 1.0 + 1e-12
    none, rates = [np.exp(-1.0 / h) for h in hours.values()], [1.0 / h for h in hours.values()]
    exactly_one = sum((1 - none[j]) * np.prod(none) / none[j] for j in range(3))
    assert np.isclose(found.low, np.prod(none) + exactly_one, rtol=1e-9)
    assert found.low < found.likely < found.high and found.coverage == pytest.approx(1.0)
    assert sum(rates) > 0.0


def test_interval_holds_what_random_failures_show() -> None:
    survived = np.zeros((3, 100), dtype=bool)
    survived[0, 50:], survived[1] = True, True
    hours = np.array([1.0, 2.0, 3.0])
    found = mission_survival(ARM, survived, T, END, dict(enumerate(hours)))
    at = np.random.default_rng(0).exponential(hours * 3600.0, size=(200_000, 3))
    first = at.argmin(axis=1)
    when = at.min(axis=1)
    kept = survived[first, np.minimum(when // 36.0, 99).astype(int)]
    second = (at < END).sum(axis=1) > 1
    alone, any_number = (when >= END) | (kept & ~second), (when >= END) | kept
    assert found.low <= alone.mean() + 0.005 and found.high >= any_number.mean() - 0.005
    assert found.high - found.low < 0.35 and found.low <= found.likely <= found.high
    assert found.coverage == pytest.approx((0.5 * 1.0 + 1.0 / 2.0) / (1.0 + 1.0 / 2.0 + 1.0 / 3.0), abs=0.01)


def test_wrong_rates_are_refused() -> None:
    survived = np.ones((3, 100), dtype=bool)
    for mtbf, sentence in (({"j9": 1.0}, "j9"), ({"j1": 0.0}, "mtbf of 'j1' is 0"), ({}, "mtbf is empty")):
        with pytest.raises(InputError, match=sentence):
            mission_survival(ARM, survived, T, END, mtbf)
