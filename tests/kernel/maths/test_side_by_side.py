"""Eight joints at once: in compiled code what numpy makes of the same numbers in plain Python."""

import numpy as np
import pytest

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.elementary import any_of, floor, larger, select, smaller, sqrt
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
from ftqp.kernel.maths.trigonometry import sin_cos

VALUES = np.array([3.0, -1.0, 0.0, 2.5, -7.0, 1e300, -0.0, 4.0, 9.0, -2.0])
CODES = np.array([0, 1, 0, -3, 0, 0, 2**40, 0, 5, 0])


INPUTS = np.concatenate([np.linspace(-9.0, 9.0, 37), [0.0, -0.0, 1e-12, 4e4, -4e4, 0.5 * np.pi, np.nan]])


@jit
def mixture(x, y):
    """Every operator and elementary function in one number."""
    s, c = sin_cos(x)
    z = x + y * 2.0 - 1 / (3.0 + abs(y)) + (-x) * 0.5
    z -= sqrt(abs(z)) * floor(x)
    z *= 0.25
    z += select((x > y) & ~(x >= 3.0) | (y < -2.0), larger(s, y), smaller(c, 2.0))
    return z / 1.5, s, c


@jit
def mix(array, other, out):
    x, y = several(array, 0), several(other, 0)
    z, s, c = mixture(x, y)
    put(out, 0, z)
    put(out, 8, s)
    put(out, 16, c)
    return any_of(x > 1e3)


@jit
def write(array, at, source, first):
    put(array, at, several(source, first))


@jit
def arithmetic(array, at, out):
    x = several(array, at)
    put(out, 0, select(x > 0.0, larger(x, 3.0), smaller(-x, 1.0)) + numbers(at) * sqrt(abs(x)))


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


@pytest.mark.parametrize("first", range(0, len(INPUTS) - WIDTH, 3))
def test_every_operator_means_for_eight_numbers_what_it_means_for_one(first):
    x, y, out = INPUTS[first : first + WIDTH], INPUTS[::-1][first : first + WIDTH].copy(), np.zeros(3 * WIDTH)
    assert mix(x, y, out) == (x > 1e3).any()
    one = getattr(mixture, "py_func", mixture)
    expected = np.array([one(np.float64(a), np.float64(b)) for a, b in zip(x, y, strict=True)])
    np.testing.assert_allclose(out.reshape(3, WIDTH).T, expected, rtol=1e-14, atol=1e-14)


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
