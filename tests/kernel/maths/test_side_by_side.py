"""Elementary functions, one or eight joints at once: what numpy makes of the same numbers."""

from math import inf, nan

import numpy as np
import pytest

from ftqp.core import pose
from ftqp.kernel.jit import jit
from ftqp.kernel.maths.elementary import any_of, floor, is_finite, is_rotation, larger, select, smaller, sqrt
from ftqp.kernel.maths.side_by_side import (
    WIDTH,
    all_of,
    below,
    largest_of,
    put,
    several,
    sin_cos,
    sum_of,
)

VALUES = np.array([3.0, -1.0, 0.0, 2.5, -7.0, 1e300, -0.0, 4.0, 9.0, -2.0])
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
def summed(array, at):
    return sum_of(several(array, at))


@jit
def most(array, at):
    return largest_of(several(array, at))


@jit
def rise_below(array, at, count):
    return all_of((several(array, at) < 5.0) | ~below(count, at))


@pytest.mark.parametrize("first", range(0, len(INPUTS) - WIDTH, 3))
def test_every_operator_means_for_eight_numbers_what_it_means_for_one(first):
    x, y, out = INPUTS[first : first + WIDTH], INPUTS[::-1][first : first + WIDTH].copy(), np.zeros(3 * WIDTH)
    assert mix(x, y, out) == (x > 1e3).any()
    one = getattr(mixture, "py_func", mixture)
    expected = np.array([one(np.float64(a), np.float64(b)) for a, b in zip(x, y, strict=True)])
    np.testing.assert_allclose(out.reshape(3, WIDTH).T, expected, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("at", [0, 1, 2])
def test_a_sum_and_the_largest_are_of_all_eight(at):
    values = np.arange(10.0) ** 2
    assert summed(values, at) == values[at : at + WIDTH].sum()
    assert most(VALUES, at) == VALUES[at : at + WIDTH].max()
    for k in range(WIDTH):
        one = np.zeros(WIDTH)
        one[k] = 1.0
        assert summed(one, 0) == most(one, 0) == 1.0


def test_a_nan_holds_no_condition():
    values = np.zeros(WIDTH)
    values[6] = np.nan
    assert not rise_below(values, 0, WIDTH)
    assert rise_below(values, 0, 6)


def test_sine_and_cosine_are_those_of_numpy():
    angles = np.concatenate(
        [np.linspace(-20.0, 20.0, 4001), np.random.default_rng(1).uniform(-1e5, 1e5, 4000)]
    )
    found = np.array([sin_cos(angle) for angle in angles])
    np.testing.assert_allclose(
        found, np.stack([np.sin(angles), np.cos(angles)], axis=1), rtol=0.0, atol=4e-16
    )


@jit
def sum_is_finite(x, y):
    """Compiled as the kernel is, this folds into "always" when finiteness is written x - x == 0."""
    return is_finite(x + y)


@pytest.mark.parametrize("x", [nan, inf, -inf])
def test_nan_and_infinities_are_found(x):
    assert not is_finite(x)
    assert not sum_is_finite(x, 1.0)
    assert not sum_is_finite(1.0, x)


def test_an_overflow_is_found():
    assert not sum_is_finite(1.7e308, 1.7e308)


def packed(rotation):
    result = np.eye(4)
    result[:3, :3] = rotation
    return result.ravel()


def test_rotations_are_rotations():
    rng = np.random.default_rng(0)
    for _ in range(100):
        assert is_rotation(packed(pose.rotation_exp(rng.uniform(-4.0, 4.0, 3))))


@pytest.mark.parametrize("scale", [0.0, 0.5, 1.0 - 1e-6, 1.0 + 1e-6, -1.0, 1e3])
def test_scaled_and_mirrored_rotations_are_none(scale):
    assert not is_rotation(packed(scale * pose.rotation_exp(np.array([0.3, -1.0, 0.2]))))
