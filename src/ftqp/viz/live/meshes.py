"""The look of an arm: from the meshes of its URDF, or barrels and tubes of its chain; simple solids."""

import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from ftqp.core.checks import FloatArray, IntArray
from ftqp.core.errors import FtqpError, InputError
from ftqp.core.pose import rotation_to, transform
from ftqp.model.capsules import Collision
from ftqp.model.chain import Chain, axis_rotation, ends_of, frame_id
from ftqp.model.reading.safe_xml import refuse_other_than_mesh, xml_of
from ftqp.model.reading.urdf import shapes_of
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


LOOKS = ("chain", "collision", "visual")
"""What an arm can be drawn from: its chain alone, or meshes of its URDF that are light, or that are seen."""
MOST_FACES = 20_000
"""Triangles that all meshes of an arm may have together; heavier ones are simplified."""
FINEST, COARSER = 1.0 / 400.0, 1.4
"""First size of a cell in which corners become one, as a share of a mesh's size, and by how much it grows."""


def mesh_parts(robot: Robot, urdf: Any, look: str = "collision") -> tuple[Part, ...]:
    """The parts of an arm from a URDF, each in the coordinates of its joint's frame.

    Whatever goes wrong costs the meshes and not the picture: a line on standard error says what, and the
    arm is drawn from its chain.

    ``urdf`` is the path of the file that the arm was read from, or its text; None draws the chain.
    """
    if look not in LOOKS:
        raise InputError(f"meshes is {look!r}, expected one of {', '.join(LOOKS)}")
    if look == "chain" or urdf is None:
        return arm_parts(robot)
    try:
        return _parts(robot, urdf, look)
    except (FtqpError, OSError, ValueError, ImportError, KeyError, IndexError, TypeError) as error:
        print(f"ftqp: {robot.name} is drawn from its chain: {_first_line(error)}", file=sys.stderr)
        return arm_parts(robot)


def _parts(robot: Robot, urdf: Any, look: str) -> tuple[Part, ...]:
    """Barrels that show the joints' conditions, and a body for each link that has one."""
    _, root, path = xml_of(urdf, "URDF", "robot")
    links = {link.get("name", ""): link for link in root.iter("link")}
    bodies: dict[int, list[Mesh]] = {}
    for shape in shapes_of(links, path, look, mirrored=True):
        placed = _place_of(robot, shape.link)
        if placed is None:
            continue
        frame, T = placed[0], placed[1] @ shape.place
        bodies.setdefault(frame, []).append(_triangles(shape).moved(T[:3, :3], T[:3, 3]))
    if not bodies:
        raise InputError(f"its URDF has no {look} bodies on the way to {', '.join(map(repr, robot.tips))}")
    whole = {frame: joined(meshes) for frame, meshes in bodies.items()}
    light = dict(zip(whole, simplified(list(whole.values())), strict=True))
    parts = [
        Part(name=f"body{frame + 1}", kind="base" if frame == BASE else "body", frame=frame, mesh=mesh)
        for frame, mesh in light.items()
    ]
    covered = {frame for frame in light if frame != BASE}
    bare = [part for part in arm_parts(robot) if part.kind == "joint" and part.frame not in covered]
    return (*parts, *bare)


def _place_of(robot: Robot, link: str) -> tuple[int, FloatArray] | None:
    """The joint frame that moves a link, and the link's pose in it; None for links off the arm."""
    model = robot.model
    try:
        frame = model.frames[frame_id(model, link)]
    except FtqpError:
        return None
    joint = int(frame.parentJoint)
    T = np.array(frame.placement.homogeneous)
    if joint == 0:
        return BASE, T
    turn = axis_rotation(model.joints[joint])
    return joint - 1, transform(turn.T, np.zeros(3)) @ T


def _triangles(shape: Collision) -> Mesh:
    """A piece of a link in its own frame."""
    size = np.array(shape.size)
    match shape.kind:
        case "box":
            return box(size)
        case "sphere":
            return ball(size[0])
        case "mesh":
            from ftqp.model.collision_geometry import found_mesh  # it loads coal, which few pages need

            mesh = read_mesh(found_mesh(shape))
            return replace(mesh, vertices=mesh.vertices * size)
        case _:
            return capsule(size[0], 0.5 * size[1], round_ends=shape.kind == "capsule")


def read_mesh(file: Path) -> Mesh:
    """The triangles of a file that trimesh reads: STL, OBJ, PLY, GLB; DAE where pycollada is installed."""
    import trimesh  # comes with viser; half a second that no other page waits for

    refuse_other_than_mesh(file)
    try:
        found: Any = trimesh.load(file, force="mesh")
    except Exception as error:  # trimesh raises what its many readers raise
        raise InputError(f"mesh {file.name!r} cannot be read: {_first_line(error)}") from error
    vertices, faces = np.asarray(found.vertices, dtype=np.float64), np.asarray(found.faces, dtype=np.int64)
    if not len(faces) or not np.isfinite(vertices).all():
        raise InputError(f"mesh {file.name!r} has no triangles, or corners that are no numbers")
    return Mesh(vertices, faces)


def simplified(meshes: Sequence[Mesh]) -> list[Mesh]:
    """Meshes with ``MOST_FACES`` triangles at most: corners in a cell become one, and cells grow."""
    result, cell = list(meshes), FINEST
    while sum(len(mesh.faces) for mesh in result) > MOST_FACES:
        result = [_clustered(mesh, cell) for mesh in meshes]
        cell *= COARSER
    return result


def _clustered(mesh: Mesh, cell: float) -> Mesh:
    """A mesh whose corners within a cell, given as a share of its size, have become their mean."""
    low = mesh.vertices.min(axis=0)
    edge = cell * float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    keys = np.floor((mesh.vertices - low) / edge).astype(np.int64)
    _, home, count = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    home = home.ravel()
    vertices = np.zeros((len(count), 3))
    np.add.at(vertices, home, mesh.vertices)
    faces = home[mesh.faces]
    whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    faces = faces[whole]
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return Mesh(vertices / count[:, None], faces[np.sort(first)])


def _first_line(error: BaseException) -> str:
    """What an exception says first."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0]
