"""Paths again and again, and backwards."""

import numpy as np
import pytest

import ftqp
from ftqp.control.paths.repeated import Backwards, Repeated, is_closed

START = np.eye(4)
CIRCLE = ftqp.paths.Circle(START, 0.1, duration=4.0)
LINE = ftqp.paths.Line(START, (0.3, 0.0, 0.1), duration=2.0)


@pytest.mark.parametrize("path", [CIRCLE, LINE])
def test_first_lap_is_the_path_bit_by_bit(path):
    t = np.arange(0.0, path.duration, 0.01)
    one, other = path.sample(t), Repeated(path, 3).sample(t)
    for name in ("pose", "twist", "acceleration"):
        np.testing.assert_array_equal(getattr(other, name), getattr(one, name))


def test_closed_path_goes_round_and_an_open_one_there_and_back():
    assert is_closed(CIRCLE) and not is_closed(LINE)
    assert (Repeated(CIRCLE, 2).lap, Repeated(LINE, 2).lap) == (4.0, 4.0)
    np.testing.assert_allclose(Repeated(CIRCLE, 9).sample(9.3).pose, CIRCLE.sample(1.3).pose, atol=1e-12)
    there_and_back = Repeated(LINE, 9)
    np.testing.assert_allclose(there_and_back.sample(11.3).pose, LINE.sample(0.7).pose, atol=1e-12)
    np.testing.assert_allclose(there_and_back.sample(8.0).pose[0], START, atol=1e-12)


@pytest.mark.parametrize("path", [Repeated(CIRCLE, 3), Repeated(LINE, 3), Backwards(LINE)])
def test_twist_and_acceleration_are_derivatives_of_the_pose(path):
    h, t = 1e-5, np.linspace(0.11, path.duration - 0.11, 37)
    before, now, after = (path.sample(t + s) for s in (-h, 0.0, h))
    np.testing.assert_allclose((after.pose - before.pose)[:, :3, 3] / (2 * h), now.twist[:, :3], atol=1e-6)
    np.testing.assert_allclose((after.twist - before.twist) / (2 * h), now.acceleration, atol=1e-4)


def test_backwards_begins_where_the_path_ends():
    back = Backwards(LINE)
    np.testing.assert_array_equal(back.start, LINE.sample(2.0).pose[0])
    np.testing.assert_allclose(back.sample(2.0).pose[0], LINE.start, atol=1e-12)
