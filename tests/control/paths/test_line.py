import numpy as np

from ftqp.control.paths import Line


def test_line_is_straight_and_ends_at_its_displacement(start):
    way = Line(start, [0.1, 0.2, -0.3], duration=2.0).sample([0.6, 2.0]).pose[:, :3, 3] - start[:3, 3]
    np.testing.assert_allclose(np.cross(way[0], way[1]), 0.0, atol=1e-15)
    np.testing.assert_allclose(way[1], [0.1, 0.2, -0.3], atol=1e-15)
