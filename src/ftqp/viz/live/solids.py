"""Simple solids as triangles: cylinder, tube between two points, box, ball and hull."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from ftqp.core.checks import FloatArray, IntArray
from ftqp.model.chain import rotation_to

SIDES = 24
"""Sides of a cylinder."""
RINGS = 12
"""Rings of a ball."""


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Triangles: corners, (k, 3) [m], and three of them for each, counter-clockwise from outside, (f, 3)."""

    vertices: FloatArray
    faces: IntArray

    def moved(self, rotation: FloatArray, translation: FloatArray) -> "Mesh":
        """The same triangles at another place, rotation (3, 3) first, then translation (3,) [m]."""
        return Mesh(self.vertices @ rotation.T + translation, self.faces)


def joined(meshes: Iterable[Mesh]) -> Mesh:
    """Several meshes as one."""
    vertices, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=np.int64)], 0
    for mesh in meshes:
        vertices.append(mesh.vertices)
        faces.append(mesh.faces + count)
        count += len(mesh.vertices)
    return Mesh(np.vstack(vertices), np.vstack(faces))


def cylinder(radius: float, low: float, high: float, top_radius: float | None = None) -> Mesh:
    """A closed cylinder along z from ``low`` to ``high`` [m]; with another radius at its top, a cone's part.

    Corners at the rims are doubled, so that light breaks there.
    """
    turn = 2.0 * np.pi * np.arange(SIDES) / SIDES
    ring = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(SIDES)])
    above = radius if top_radius is None else top_radius
    bottom, top = radius * ring + [0.0, 0.0, low], above * ring + [0.0, 0.0, high]
    middle = np.array([[0.0, 0.0, low], [0.0, 0.0, high]])
    vertices = np.vstack([bottom, top, bottom, top, middle])
    here = np.arange(SIDES)
    after = (here + 1) % SIDES
    wall = [
        np.column_stack([here, after, SIDES + after]),
        np.column_stack([here, SIDES + after, SIDES + here]),
    ]
    lids = [
        np.column_stack([2 * SIDES + after, 2 * SIDES + here, np.full(SIDES, 4 * SIDES)]),
        np.column_stack([3 * SIDES + here, 3 * SIDES + after, np.full(SIDES, 4 * SIDES + 1)]),
    ]
    return Mesh(vertices, np.vstack([*wall, *lids]))


def hull(points: FloatArray) -> Mesh:
    """The convex hull of some points, (k, 3) [m]; triangles share no corners, so that light breaks there."""
    found = ConvexHull(points)
    corners = points[found.simplices]
    a, b, c = corners.transpose(1, 0, 2)
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), found.equations[:, :3]) < 0.0
    corners[inward] = corners[inward][:, ::-1]
    return Mesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


def tube(start: FloatArray, end: FloatArray, radius: float) -> Mesh:
    """A cylinder between two points, (3,) each [m]; nothing where they coincide."""
    along = np.asarray(end, dtype=np.float64) - start
    length = float(np.linalg.norm(along))
    if length == 0.0:
        return joined([])
    return cylinder(radius, 0.0, length).moved(rotation_to(along / length), np.asarray(start))


def box(size: FloatArray) -> Mesh:
    """A box around the origin with edges of the lengths ``size``, (3,) [m]."""
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    vertices: list[FloatArray] = []
    faces: list[list[int]] = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            corners = np.empty((4, 3))
            corners[:, axis] = side
            corners[:, [(axis + 1) % 3, (axis + 2) % 3]] = square[:: int(side)]
            faces += [[4 * len(vertices) + k for k in triangle] for triangle in ((0, 1, 2), (0, 2, 3))]
            vertices.append(corners)
    return Mesh(0.5 * np.vstack(vertices) * size, np.array(faces))


def ball(radius: float, center: FloatArray | None = None) -> Mesh:
    """A ball around a point, (3,) [m], or around the origin."""
    turn = 2.0 * np.pi * np.arange(SIDES) / SIDES
    rise = np.pi * np.arange(RINGS + 1) / RINGS
    x = np.outer(np.sin(rise), np.cos(turn)).ravel()
    y = np.outer(np.sin(rise), np.sin(turn)).ravel()
    z = np.repeat(np.cos(rise), SIDES)
    faces = []
    for ring in range(RINGS):
        here = ring * SIDES + np.arange(SIDES)
        after = ring * SIDES + (np.arange(SIDES) + 1) % SIDES
        if ring > 0:
            faces.append(np.column_stack([here, here + SIDES, after]))
        if ring < RINGS - 1:
            faces.append(np.column_stack([after, here + SIDES, after + SIDES]))
    middle = np.zeros(3) if center is None else center
    return Mesh(radius * np.column_stack([x, y, z]) + middle, np.vstack(faces))
