import numpy as np
import pytest

from ftqp.control.paths import Line
from ftqp.core.errors import InputError


def test_line_is_straight_and_ends_at_its_displacement(start):
    way = Line(start, [0.1, 0.2, -0.3], duration=2.0).sample([0.6, 2.0]).pose[:, :3, 3] - start[:3, 3]
    np.testing.assert_allclose(np.cross(way[0], way[1]), 0.0, atol=1e-15)
    np.testing.assert_allclose(way[1], [0.1, 0.2, -0.3], atol=1e-15)


@pytest.mark.parametrize(
    ("displacement", "message"),
    [
        ([0, 0, 0], "is zero"),
        ([1, 0], r"has shape \(2,\)"),
        ([1, 0, np.inf], "is infinite"),
        ("x", "is not an array"),
    ],
)
def test_wrong_displacement_is_one_clear_sentence(start, displacement, message):
    with pytest.raises(InputError, match=f"displacement of the line {message}"):
        Line(start, displacement, duration=1.0)
