import numpy as np
import pytest

from ftqp.control.paths import Square
from ftqp.core.errors import InputError


def test_square_visits_its_corners_in_order_and_closes(start):
    way = Square(start, 0.039, duration=20.0).sample([0, 5, 10, 15, 20]).pose[:, :3, 3] - start[:3, 3]
    side = 0.039
    corners = [[0, 0, 0], [side, 0, 0], [side, side, 0], [0, side, 0], [0, 0, 0]]
    np.testing.assert_allclose(way, corners, atol=1e-15)


def test_square_rests_at_its_corners(start):
    sample = Square(start, 0.039, duration=20.0).sample([5.0, 10.0, 15.0])
    np.testing.assert_allclose(sample.twist, 0.0, atol=1e-15)
    np.testing.assert_allclose(sample.acceleration, 0.0, atol=1e-12)


def test_first_side_follows_the_quintic(start):
    u = 0.3
    p = Square(start, 0.1, duration=4.0).sample(u).pose[0, :3, 3] - start[:3, 3]
    np.testing.assert_allclose(p, [0.1 * (10 * u**3 - 15 * u**4 + 6 * u**5), 0, 0], atol=1e-15)


def test_constant_speed_turns_at_the_corner_tick_despite_rounding(start):
    path = Square(start, 0.1, duration=1.2, law="constant")
    corner = path.sample(3 * 0.1).twist[0]
    np.testing.assert_allclose(corner[:3], [0.0, 0.1 / 0.3, 0.0], atol=1e-12)


def test_axes_turn_the_plane(start):
    way = Square(start, 1.0, duration=4.0, axes=("z", [0.0, -2.0, 0.0])).sample([1.0, 2.0]).pose[:, :3, 3]
    np.testing.assert_allclose(way - start[:3, 3], [[0, 0, 1], [0, -1, 1]], atol=1e-15)


@pytest.mark.parametrize(
    ("axes", "message"),
    [
        (("x", "x"), "axes of the plane have the cosine 1, expected perpendicular"),
        (("x", "w"), "'w' is not a direction of the second axis"),
        (("x",), "axes is .* expected two directions"),
        ("xy", "axes is 'xy', expected two directions"),
        (("x", [0, 0, 0]), "second axis is the zero vector"),
        (("x", [0, np.nan, 0]), "second axis contains NaN"),
    ],
)
def test_wrong_axes_are_one_clear_sentence(start, axes, message):
    with pytest.raises(InputError, match=message):
        Square(start, 0.1, duration=1.0, axes=axes)


@pytest.mark.parametrize("side", [0.0, -1.0, np.inf])
def test_side_must_be_positive(start, side):
    with pytest.raises(InputError, match="side of the square is"):
        Square(start, side, duration=1.0)
