"""The look of an arm of which only joints and tips are known, and simple solids, which it is made of.

Barrels stand for joints, tubes for links; cylinder, tube, box, ball and hull are triangles.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from ftqp.core.checks import FloatArray, IntArray
from ftqp.model.chain import Chain, ends_of, rotation_to
from ftqp.model.robot import Robot

BASE = -1
"""Index of the frame that does not move."""
THICK = 0.055
"""Radius of the first barrel, as a share of the arm's size."""
TAPER = 0.55
"""By how much the barrels become thinner to the tip, as a share of the first."""
SLIM = 0.72
"""Radius of a tube, as a share of the barrel's that it begins at."""
TALL = 2.1
"""Length of a barrel, in its radii."""
STRAIGHT = 0.02
"""A part of an elbow below this share of the other is left out."""
NEAR = 1e-3
"""Origins nearer to each other than this share of the arm's size have no tube between them."""
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Part:
    """A rigid part of an arm, whose mesh stands in a joint's frame, or in ``BASE``.

    The kind is ``joint``, ``link``, ``base``, ``tip``, or ``body``: a link that shows its joint's condition.
    """

    name: str
    kind: str
    frame: int
    mesh: Mesh


def size_of(chain: Chain) -> float:
    """By what everything of a scene is scaled [m]: distances between origins, first joint to tip, > 0."""
    way = chain.way(chain.tip_joint)
    steps = np.vstack([chain.translation[way[1:]], chain.tip_translation[None]])
    size = float(np.linalg.norm(steps, axis=1).sum())
    return size if size > 0.0 else float(np.linalg.norm(chain.translation[0])) or 1.0


def radii(chain: Chain) -> FloatArray:
    """Radius of each joint's barrel, (nv,) [m]: 0.055 size (1 - 0.55 k / n), k of n joints before it."""
    before = np.array([len(chain.way(i)) - 1 for i in range(len(chain.names))])
    return np.asarray(THICK * size_of(chain) * (1.0 - TAPER * before / (before.max() + 1)))


def arm_parts(robot: Robot) -> tuple[Part, ...]:
    """All parts of a robot, base to tips, each in the coordinates of its joint's frame."""
    chain = robot.chain
    size, thick = size_of(chain), radii(chain)
    parts = [Part(name="base", kind="base", frame=BASE, mesh=_base(chain, float(thick[0]), size))]
    tips = [(body, at) for body, _, at in ends_of(robot.model, robot.tips)]
    ends = [*zip(chain.parent.tolist(), chain.translation, strict=True), *tips]
    for i in range(robot.nv):
        radius = float(thick[i])
        parts.append(Part(name=f"joint{i}", kind="joint", frame=i, mesh=_joint(chain, i, radius)))
        link = joined([_link(end, SLIM * radius, size) for body, end in ends if body == i])
        if len(link.faces):
            parts.append(Part(name=f"link{i}", kind="link", frame=i, mesh=link))
    for k, (body, at) in enumerate(tips):
        tip = ball(1.1 * SLIM * float(thick[body]), at)
        parts.append(Part(name=f"tip{k or ''}", kind="tip", frame=body, mesh=tip))
    return tuple(parts)


def _joint(chain: Chain, i: int, radius: float) -> Mesh:
    """A barrel about the axis of a joint that turns, a box on one that slides."""
    if chain.prismatic[i]:
        return box(radius * np.array([2.0, 2.0, TALL]))
    half = 0.5 * TALL * radius
    return cylinder(radius, -half, half)


def _link(end: FloatArray, radius: float, size: float) -> Mesh:
    """From a frame's origin to a point: along the frame's z axis, then across, with a ball in the elbow."""
    along, across = abs(float(end[2])), float(np.hypot(end[0], end[1]))
    if np.hypot(along, across) < NEAR * size:
        return joined([])
    start = np.zeros(3)
    if min(along, across) < STRAIGHT * max(along, across):
        return tube(start, end, radius)
    elbow = np.array([0.0, 0.0, end[2]])
    return joined([tube(start, elbow, radius), ball(radius, elbow), tube(elbow, end, radius)])


def _base(chain: Chain, radius: float, size: float) -> Mesh:
    """A foot plate and what carries the first joints."""
    plate = cylinder(2.1 * radius, -0.35 * radius, 0.0, 1.9 * radius)
    pillars = [_link(chain.translation[i], 1.15 * radius, size) for i in np.flatnonzero(chain.parent < 0)]
    return joined([plate, *pillars])
