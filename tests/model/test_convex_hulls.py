"""Convex hulls: their corners, edges and faces, and simpler bodies around those with many."""

import numpy as np
import pytest

from ftqp.core.errors import InputError
from ftqp.model.collision_geometry import CORNERS, hull_of


def directions(count):
    found = np.random.default_rng(0).normal(size=(count, 3))
    return found / np.linalg.norm(found, axis=1)[:, None]


def test_a_box_has_eight_corners_twelve_edges_and_six_faces():
    points = np.array([[x, y, z] for x in (0, 1) for y in (0, 2) for z in (0, 3)], dtype=float)
    hull = hull_of(np.vstack([points, 0.5 * points + 0.2]))
    assert (len(hull.corners), len(hull.edges), len(hull.faces)) == (8, 12, 6)
    lengths = np.linalg.norm(np.diff(hull.corners[hull.edges], axis=1)[:, 0], axis=1)
    assert sorted(lengths.round(9).tolist()) == [1.0] * 4 + [2.0] * 4 + [3.0] * 4


@pytest.mark.parametrize("count", [5, 30, 2000])
@pytest.mark.parametrize("size", [1e-3, 1.0])
def test_every_point_is_within_and_every_corner_on_the_hull(count, size):
    points = size * directions(count) * [1.0, 0.6, 0.3] + size
    hull = hull_of(points)
    assert len(hull.corners) <= CORNERS
    assert len(hull.corners) - len(hull.edges) + len(hull.faces) == 2  # Euler
    above = points @ hull.faces[:, :3].T - hull.faces[:, 3]
    assert above.max() < 1e-11 * size
    own = hull.corners @ hull.faces[:, :3].T - hull.faces[:, 3]
    assert own.max() < 1e-9 * size and (np.abs(own) < 1e-9 * size).sum(axis=1).min() >= 3


@pytest.mark.parametrize(("most", "stands_out"), [(32, 0.26), (64, 0.15)])
def test_around_a_ball_it_stands_out_by_a_seventh_of_the_radius(most, stands_out):
    hull = hull_of(directions(3000), most)
    assert len(hull.corners) <= most
    assert 1.0 < np.linalg.norm(hull.corners, axis=1).max() < 1.0 + stands_out


@pytest.mark.parametrize(
    "points", [np.zeros((0, 3)), np.zeros((5, 3)), np.eye(3), np.ones((9, 3)) * [1, 2, 0]]
)
def test_points_without_a_body_are_refused(points):
    with pytest.raises(InputError, match="have no body between them"):
        hull_of(points)
