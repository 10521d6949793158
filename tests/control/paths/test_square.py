import numpy as np

from ftqp.control.paths import Square


def test_square_visits_its_corners_in_order_and_closes(start):
    way = Square(start, 0.039, duration=20.0).sample([0, 5, 10, 15, 20]).pose[:, :3, 3] - start[:3, 3]
    side = 0.039
    corners = [[0, 0, 0], [side, 0, 0], [side, side, 0], [0, side, 0], [0, 0, 0]]
    np.testing.assert_allclose(way, corners, atol=1e-15)


def test_square_rests_at_its_corners(start):
    sample = Square(start, 0.039, duration=20.0).sample([5.0, 10.0, 15.0])
    np.testing.assert_allclose(sample.twist, 0.0, atol=1e-15)
    np.testing.assert_allclose(sample.acceleration, 0.0, atol=1e-12)


def test_constant_speed_turns_at_the_corner_tick_despite_rounding(start):
    path = Square(start, 0.1, duration=1.2, law="constant")
    corner = path.sample(3 * 0.1).twist[0]
    np.testing.assert_allclose(corner[:3], [0.0, 0.1 / 0.3, 0.0], atol=1e-12)


def test_axes_turn_the_plane(start):
    way = Square(start, 1.0, duration=4.0, axes=("z", [0.0, -2.0, 0.0])).sample([1.0, 2.0]).pose[:, :3, 3]
    np.testing.assert_allclose(way - start[:3, 3], [[0, 0, 1], [0, -1, 1]], atol=1e-15)
