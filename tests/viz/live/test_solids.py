"""Solids are closed, point outward and enclose the volume that they should."""

import numpy as np
import pytest

from ftqp.viz.live.solids import RINGS, SIDES, ball, box, cylinder, joined, tube

POLYGON = 0.5 * SIDES * np.sin(2.0 * np.pi / SIDES)
"""Area of the polygon that stands for a circle of radius one."""


def volume(mesh):
    """Sum of the signed volumes of the tetrahedra between the origin and each face."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def open_edges(mesh):
    """Directed edges between places that no face uses in the other direction."""
    places = np.unique(np.round(mesh.vertices, 9), axis=0, return_inverse=True)[1].ravel()[mesh.faces]
    edges = {(int(f[k]), int(f[(k + 1) % 3])) for f in places for k in range(3)}
    return {edge for edge in edges if edge[::-1] not in edges}


@pytest.mark.parametrize(
    ("mesh", "expected"),
    [
        (cylinder(0.3, -0.2, 0.5), POLYGON * 0.09 * 0.7),
        (tube(np.array([1.0, 2.0, 3.0]), np.array([1.0, 1.0, 2.0]), 0.1), POLYGON * 0.01 * np.sqrt(2.0)),
        (box(np.array([1.0, 2.0, 3.0])), 6.0),
        (joined([box(np.ones(3)), box(np.full(3, 2.0))]), 9.0),
    ],
)
def test_volume_is_that_of_the_solid(mesh, expected):
    assert volume(mesh) == pytest.approx(expected, rel=1e-12)
    assert not open_edges(mesh)


def test_ball_is_closed_and_nearly_a_sphere():
    mesh = ball(0.4, np.array([1.0, 0.0, 0.0]))
    assert np.allclose(np.linalg.norm(mesh.vertices - [1.0, 0.0, 0.0], axis=1), 0.4)
    assert volume(mesh) == pytest.approx(4.0 / 3.0 * np.pi * 0.064, rel=2.0 / RINGS**1.5)
    assert not open_edges(mesh)


def test_tube_without_length_is_nothing():
    assert len(tube(np.ones(3), np.ones(3), 0.1).faces) == 0
