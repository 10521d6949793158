"""Finiteness, also of sums, also compiled."""

from math import inf, nan

import numpy as np
import pytest

from ftqp.core import pose
from ftqp.kernel.jit import jit
from ftqp.kernel.maths.elementary import is_finite, is_rotation


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
