"""Eight joints at once: in compiled code what numpy makes of the same numbers in plain Python."""

import numpy as np
import pytest

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.elementary import larger, select, smaller, sqrt
from ftqp.kernel.maths.side_by_side import (
    WIDTH,
    all_of,
    below,
    is_set,
    largest_of,
    numbers,
    put,
    put_either,
    several,
    sum_of,
)

VALUES = np.array([3.0, -1.0, 0.0, 2.5, -7.0, 1e300, -0.0, 4.0, 9.0, -2.0])
CODES = np.array([0, 1, 0, -3, 0, 0, 2**40, 0, 5, 0])


@jit
def write(array, at, source, first):
    put(array, at, several(source, first))


@jit
def arithmetic(array, at, out):
    x = several(array, at)
    put(out, 0, select(x > 0.0, larger(x, 3.0), smaller(-x, 1.0)) + numbers(array, at) * sqrt(abs(x)))


@jit
def choose(numbers, whole, at, out):
    put_either(out, 0, is_set(whole, at) | (several(numbers, at) > 2.0), 7, -7)


@jit
def summed(array, at):
    return sum_of(several(array, at))


@jit
def most(array, at):
    return largest_of(several(array, at))


@jit
def rise_below(array, at, count):
    return all_of((several(array, at) < 5.0) | ~below(count, at))


@pytest.mark.parametrize("at", [0, 1, 2])
def test_numbers_are_those_from_a_place_on(at):
    out = np.zeros(12)
    write(out, 3, VALUES, at)
    assert np.array_equal(out, [0.0] * 3 + list(VALUES[at : at + WIDTH]) + [0.0])


@pytest.mark.parametrize("at", [0, 2])
def test_formulas_take_eight_numbers_as_they_take_one(at):
    out = np.zeros(WIDTH)
    arithmetic(VALUES, at, out)
    for k, x in enumerate(VALUES[at : at + WIDTH]):
        expected = (max(x, 3.0) if x > 0.0 else min(-x, 1.0)) + (at + k) * np.sqrt(abs(x))
        assert out[k] == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("at", [0, 2])
def test_whole_numbers_are_chosen_by_a_condition(at):
    out = np.zeros(WIDTH, dtype=np.int64)
    choose(VALUES, CODES, at, out)
    here = slice(at, at + WIDTH)
    assert np.array_equal(out, np.where((CODES[here] != 0) | (VALUES[here] > 2.0), 7, -7))


@pytest.mark.parametrize("at", [0, 1, 2])
def test_a_sum_and_the_largest_are_of_all_eight(at):
    values = np.arange(10.0) ** 2
    assert summed(values, at) == values[at : at + WIDTH].sum()
    assert most(VALUES, at) == VALUES[at : at + WIDTH].max()
    for k in range(WIDTH):
        one = np.zeros(WIDTH)
        one[k] = 1.0
        assert summed(one, 0) == most(one, 0) == 1.0


@pytest.mark.parametrize(("count", "holds"), [(0, True), (5, True), (6, False), (8, False)])
def test_what_is_behind_the_last_joint_does_not_count(count, holds):
    assert rise_below(VALUES, 0, count) == holds


def test_a_nan_holds_no_condition():
    values = np.zeros(WIDTH)
    values[6] = np.nan
    assert not rise_below(values, 0, WIDTH)
    assert rise_below(values, 0, 6)
