"""The look of an arm from the meshes of its URDF; where one cannot be read, that of its chain."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote
from xml.etree.ElementTree import Element

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import FtqpError, InputError
from ftqp.core.pose import rotation_exp, transform
from ftqp.model.chain import axis_rotation, frame_id
from ftqp.model.reading.safe_xml import refuse_other_than_mesh, xml_of
from ftqp.model.robot import Robot
from ftqp.viz.live.shapes import BASE, Mesh, Part, arm_parts, ball, box, cylinder, joined

LOOKS = ("chain", "collision", "visual")
"""What an arm can be drawn from: its chain alone, or meshes of its URDF that are light, or that are seen."""
MOST_FACES = 20_000
"""Triangles that all meshes of an arm may have together; heavier ones are simplified."""
LARGEST = 64 * 2**20
"""Largest file of a mesh that is read [bytes]."""
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
    bodies: dict[int, list[Mesh]] = {}
    for link in root.iter("link"):
        placed = _place_of(robot, link.get("name", ""))
        if placed is None:
            continue
        frame, T = placed
        for element in link.findall(look):
            mesh = _body(element, path)
            bodies.setdefault(frame, []).append(mesh.moved(T[:3, :3], T[:3, 3]))
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


def _body(element: Element, urdf: Path | None) -> Mesh:
    """One visual or collision body, in the coordinates of its link."""
    geometry = element.find("geometry")
    shape = geometry[0] if geometry is not None and len(geometry) else None
    if shape is None:
        raise InputError("a body of its URDF has no geometry")
    mesh = _shape(shape, urdf)
    if not np.isfinite(mesh.vertices).all() or not len(mesh.faces):
        raise InputError(f"a {shape.tag} of its URDF has no size")
    origin = element.find("origin")
    if origin is None:
        return mesh
    x, y, z = np.eye(3)
    roll, pitch, yaw = _numbers(origin.get("rpy", "0 0 0"), 3)
    return mesh.moved(
        rotation_exp(yaw * z) @ rotation_exp(pitch * y) @ rotation_exp(roll * x),
        _numbers(origin.get("xyz", "0 0 0"), 3),
    )


def _shape(shape: Element, urdf: Path | None) -> Mesh:
    """A box, cylinder, sphere or mesh file."""
    match shape.tag:
        case "box":
            return box(_numbers(shape.get("size", ""), 3))
        case "cylinder":
            half = 0.5 * _numbers(shape.get("length", ""), 1)[0]
            return cylinder(_numbers(shape.get("radius", ""), 1)[0], -half, half)
        case "sphere":
            return ball(_numbers(shape.get("radius", ""), 1)[0])
        case "mesh":
            mesh = read_mesh(found_mesh(shape.get("filename", ""), urdf))
            return replace(mesh, vertices=mesh.vertices * _numbers(shape.get("scale", "1 1 1"), 3))
        case other:
            raise InputError(f"<{other}> is no shape of a URDF")


def found_mesh(name: str, urdf: Path | None) -> Path:
    """The file of a mesh: ``package://name/rest`` is looked for in the folders above the URDF.

    ``urdf`` is None for one that was given as text.
    """
    above = [] if urdf is None else list(urdf.resolve().parents)
    scheme, mark, rest = name.partition("://")
    if not mark:
        candidates = [Path(name)] if Path(name).is_absolute() else [folder / name for folder in above[:1]]
    elif scheme == "file":
        candidates = [Path(unquote(rest))]
    else:
        package, _, inside = rest.partition("/")
        candidates = [folder / package / inside for folder in above]
        candidates += [folder / inside for folder in above if folder.name == package]
    for candidate in candidates:
        if candidate.is_file():
            return candidate
    raise InputError(f"mesh {name!r:.200} was not found beside its URDF")


def read_mesh(file: Path) -> Mesh:
    """The triangles of a file that trimesh reads: STL, OBJ, PLY, GLB; DAE where pycollada is installed."""
    import trimesh  # comes with viser; half a second that no other page waits for

    refuse_other_than_mesh(file)
    if file.stat().st_size > LARGEST:
        raise InputError(f"mesh {file.name!r} has more than {LARGEST // 2**20} MB")
    try:
        found: Any = trimesh.load(file, force="mesh")
    except Exception as error:  # trimesh raises what its many readers raise
        raise InputError(f"mesh {file.name!r} cannot be read: {_first_line(error)}") from error
    vertices, faces = np.asarray(found.vertices, dtype=np.float64), np.asarray(found.faces, dtype=np.int64)
    if not len(faces) or not np.isfinite(vertices).all():
        raise InputError(f"mesh {file.name!r} has no triangles, or corners that are no numbers")
    return Mesh(vertices, faces)


def simplified(meshes: Sequence[Mesh], most: int = MOST_FACES) -> list[Mesh]:
    """Meshes with at most ``most`` triangles: corners in a cell become one, cells grow until it fits."""
    result, cell = list(meshes), FINEST
    while sum(len(mesh.faces) for mesh in result) > most:
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


def _numbers(text: str, count: int) -> FloatArray:
    """Numbers of an attribute."""
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        values = np.zeros(0)
    if len(values) != count or not np.isfinite(values).all():
        raise InputError(f"{text!r:.60} in its URDF is not {count} finite numbers")
    return values


def _first_line(error: BaseException) -> str:
    """What an exception says first."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0]
