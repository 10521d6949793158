"""Sine and cosine of one angle and of eight."""

import numpy as np

from ftqp.kernel.maths.trigonometry import sin_cos


def test_sine_and_cosine_are_those_of_numpy():
    angles = np.concatenate(
        [np.linspace(-20.0, 20.0, 4001), np.random.default_rng(1).uniform(-1e5, 1e5, 4000)]
    )
    found = np.array([sin_cos(angle) for angle in angles])
    np.testing.assert_allclose(
        found, np.stack([np.sin(angles), np.cos(angles)], axis=1), rtol=0.0, atol=4e-16
    )
