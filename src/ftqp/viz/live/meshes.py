"""The look of an arm from the meshes of its URDF; where one cannot be read, that of its chain."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import FtqpError, InputError
from ftqp.core.pose import transform
from ftqp.model.capsules import Collision
from ftqp.model.chain import axis_rotation, frame_id
from ftqp.model.reading.safe_xml import refuse_other_than_mesh, xml_of
from ftqp.model.reading.urdf import shapes_of
from ftqp.model.robot import Robot
from ftqp.viz.live.shapes import BASE, Mesh, Part, arm_parts, ball, box, capsule, joined

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
