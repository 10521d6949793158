import numpy as np
import pytest

from ftqp.control.paths import Circle


@pytest.mark.parametrize("law", ["sine_squared", "quintic"])
def test_circle_keeps_its_radius_and_closes(start, law):
    position = Circle(start, 0.1, duration=20.0, law=law).sample(np.linspace(0, 20, 200)).pose[:, :3, 3]
    radius = np.linalg.norm(position - (start[:3, 3] - [0.1, 0, 0]), axis=1)
    np.testing.assert_allclose(radius, 0.1, atol=1e-15)
    np.testing.assert_allclose(position[-1], start[:3, 3], atol=1e-15)


def test_sine_squared_phase_is_that_of_the_source(start):
    t, duration, radius = 3.7, 20.0, 0.1
    phase = 2 * np.pi * np.sin(np.pi * t / (2 * duration)) ** 2
    expected = start[:3, 3] - [radius, 0, 0] + radius * np.array([np.cos(phase), np.sin(phase), 0])
    pose = Circle(start, radius, duration=duration, law="sine_squared").sample(t).pose[0]
    np.testing.assert_allclose(pose[:3, 3], expected, atol=1e-15)
