"""Finiteness, also of sums, also compiled."""

from math import inf, nan

import pytest

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.finite import is_finite


@jit
def sum_is_finite(x, y):
    """Compiled as the kernel is, this folds into "always" when finiteness is written x - x == 0."""
    return is_finite(x + y)


@pytest.mark.parametrize("x", [nan, inf, -inf])
def test_nan_and_infinities_are_found(x):
    assert not is_finite(x)
    assert not sum_is_finite(x, 1.0)
    assert not sum_is_finite(1.0, x)


@pytest.mark.parametrize("x", [0.0, -0.0, 1.0, -1e308, 5e-324])
def test_numbers_are_finite(x):
    assert is_finite(x)
    assert sum_is_finite(x, 1.0)


def test_an_overflow_is_found():
    assert not sum_is_finite(1.7e308, 1.7e308)
