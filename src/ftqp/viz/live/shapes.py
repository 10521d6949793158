"""The look of an arm of joints and tips alone: barrels and tubes; simple solids of triangles."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.spatial import ConvexHull

from ftqp.core.checks import FloatArray, IntArray
from ftqp.core.pose import rotation_to
from ftqp.model.chain import Chain, ends_of
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


def turned(profile: FloatArray) -> Mesh:
    """A profile of radii and heights, (k, 2) [m], turned about z; points that stand twice are sharp edges."""
    turn = 2.0 * np.pi * np.arange(SIDES) / SIDES
    around = np.stack([np.cos(turn), np.sin(turn), np.ones(SIDES)], axis=1)
    vertices = (profile[:, None, [0, 0, 1]] * around).reshape(-1, 3)
    here = np.arange(SIDES)
    after, rings = (here + 1) % SIDES, SIDES * np.arange(len(profile) - 1)[:, None]
    below = np.stack(np.broadcast_arrays(rings + here, rings + after, rings + after + SIDES), axis=-1)
    above = np.stack(np.broadcast_arrays(rings + here, rings + after + SIDES, rings + here + SIDES), axis=-1)
    faces = np.concatenate([below, above]).reshape(-1, 3)
    a, b, c = vertices[faces].transpose(1, 0, 2)
    return Mesh(vertices, faces[np.cross(b - a, c - a).any(axis=1)])


def cylinder(radius: float, low: float, high: float, top_radius: float | None = None) -> Mesh:
    """A closed cylinder along z from ``low`` to ``high`` [m]; a part of a cone with another radius above."""
    top = radius if top_radius is None else top_radius
    rims = [(0.0, low), (radius, low), (radius, low), (top, high), (top, high), (0.0, high)]
    return turned(np.array(rims))


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


_CUBE = hull(np.array(list(product((-1.0, 1.0), repeat=3))))


def box(size: FloatArray) -> Mesh:
    """A box around the origin with edges of the lengths ``size``, (3,) [m]."""
    return Mesh(0.5 * _CUBE.vertices * size, _CUBE.faces)


def ball(radius: float, center: FloatArray | None = None) -> Mesh:
    """A ball around a point, (3,) [m], or around the origin."""
    rise = np.linspace(-0.5, 0.5, RINGS + 1) * np.pi
    round_one = turned(radius * np.column_stack([np.cos(rise).round(12), np.sin(rise)]))
    return Mesh(round_one.vertices + (np.zeros(3) if center is None else center), round_one.faces)


def capsule(radius: float, half: float, *, round_ends: bool = True) -> Mesh:
    """A cylinder around the origin along z, twice ``half`` long [m], its ends round or flat."""
    ends = [ball(radius, np.array([0.0, 0.0, end])) for end in ({-half, half} if round_ends else ())]
    return joined([*ends, *([cylinder(radius, -half, half)] if half > 0.0 else [])])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Part:
    """A rigid part in a joint's frame or ``BASE``: ``joint``, ``link``, ``base``, ``tip`` or ``body``."""

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
