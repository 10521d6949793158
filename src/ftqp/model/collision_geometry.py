"""Convex bodies of collision geometry: the corners of meshes, hulls of them, and capsules around them."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations, pairwise, product
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import coal
import numpy as np
import pinocchio as pin
from scipy.optimize import minimize
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from ftqp.core.checks import FloatArray, IntArray
from ftqp.core.errors import InputError
from ftqp.model.capsules import WORLD, Capsule, Collision, HullParts, estimated, named_apart, turned_along
from ftqp.model.reading import urdf
from ftqp.model.reading.safe_xml import refuse_other_than_mesh
from ftqp.model.reduction import frame_names

SPLIT = 2.0
"""A capsule with more than so many times the volume of its hull is replaced by two of its halves ..."""
SAVES = 0.8
"""... where both together have at most this share of its volume. Conventions."""
CORNERS = 64
"""A hull with more corners is replaced by one around it that has at most so many. Around a ball it stands out
by a seventh of its radius then, and by a quarter with 32 (``pytest tests/model/test_capsules.py``)."""
SAME = 1e-9
"""Faces whose normals and offsets differ by less than this, of a hull of length 1, are one. Rounding."""
CLOSE = 1e-3
"""A hull around another one is near enough where it stands out by less than this share of its length. A
convention."""


def fitted(shapes: Sequence[Capsule | Collision]) -> tuple[Capsule, ...]:
    """Capsules that contain every shape."""
    found: list[Capsule] = []
    for shape in shapes:
        found += [shape] if isinstance(shape, Capsule) else _of(shape)
    return named_apart(found)


def bodies_of(robot: Any) -> tuple[Capsule, ...]:
    """The bodies of a robot as capsules: given, around what its file has, or estimated from its joints."""
    there = (*frame_names(robot.model), WORLD)
    own = [one for one in robot.shapes if (one.frame if isinstance(one, Capsule) else one.link) in there]
    if not own:
        return estimated(robot)
    return fitted(own)


def _of(shape: Collision) -> list[Capsule]:
    T = shape.place
    if shape.kind == "mesh":
        points = vertices(shape) @ T[:3, :3].T + T[:3, 3]
        return [Capsule(a, b, r, frame=shape.link, corners=inside) for a, b, r, inside in around(points)]
    z, middle = T[:3, 2], T[:3, 3]
    if shape.kind == "box":
        edges = np.array(shape.size)
        long = int(np.argmax(edges))
        others = np.delete(edges, long)
        radius = 0.5 * float(np.linalg.norm(others))
        half = 0.5 * max(edges[long], 0.0) * T[:3, long]
        corners = np.array(list(product((-0.5, 0.5), repeat=3))) * edges @ T[:3, :3].T + middle
        return [Capsule(middle - half, middle + half, radius, frame=shape.link, corners=corners)]
    else:
        radius = shape.size[0]
        half = 0.5 * (shape.size[1] if len(shape.size) > 1 else 0.0) * z
    return [Capsule(middle - half, middle + half, radius, frame=shape.link)]


def volume_of(shape: Collision) -> float:
    """The volume of a shape, of a mesh that of its hull [m3]."""
    if shape.kind == "mesh":
        return float(ConvexHull(vertices(shape)).volume)
    if shape.kind == "box":
        return float(np.prod(shape.size))
    r, length = shape.size[0], shape.size[1] if len(shape.size) > 1 else 0.0
    return float(np.pi * r * r * (length + (0.0 if shape.kind == "cylinder" else 4.0 / 3.0 * r)))


def volume_ratios(robot: Any) -> dict[str, float]:
    """How many times larger the capsules of a link are than the collision geometry that they contain."""
    inside, around = dict[str, float](), dict[str, float]()
    for shape in robot.shapes:
        if isinstance(shape, Collision):
            inside[shape.link] = inside.get(shape.link, 0.0) + volume_of(shape)
    for one in robot.capsules:
        around[one.frame] = around.get(one.frame, 0.0) + one.volume
    return {link: around[link] / size for link, size in inside.items() if size > 0.0 and link in around}


def vertices(shape: Collision) -> FloatArray:
    """The corners of the hull of a mesh, (V, 3) [m]."""
    if shape.corners is not None:
        return _outermost(shape.corners, shape.link)
    path = found_mesh(shape)
    return _outermost(_read(path, shape.size), f"{path} of link {shape.link!r}")


def mesh_corners(file: Any, scale: float) -> FloatArray:
    """The corners of the hull of a mesh in a file, (V, 3) [m]."""
    if not (isinstance(file, str | Path) and (path := Path(file)).is_file()):
        raise InputError(f"mesh {str(file)!r:.200} is no file, expected one in STL, OBJ, PLY, GLB or DAE")
    return _outermost(_read(path, (scale,) * 3), str(path))


def _read(path: Path, scale: Sequence[float]) -> FloatArray | str:
    """The points of a mesh, (N, 3) [m], or why it has none."""
    refuse_other_than_mesh(path)
    try:
        return np.array(coal.MeshLoader().load(str(path), np.array(scale)).vertices())
    except (RuntimeError, ValueError) as error:  # it says where in coal it was raised, and then what is wrong
        return " ".join(str(error).rpartition("message:")[2].split())


def _outermost(points: FloatArray | str, name: str) -> FloatArray:
    """The corners of the hull of some points, (V, 3) [m]; a text says why there are none."""
    try:
        if isinstance(points, str):
            raise ValueError(points)
        return np.asarray(points[ConvexHull(points).vertices], dtype=np.float64)
    except (ValueError, QhullError, IndexError) as error:
        raise InputError(
            f"mesh {name} holds no body, or is no mesh ({str(error)!s:.80}); correct it, or put shapes in "
            "its place: for a robot robot.with_capsules([...]), for a scene ftqp.Box and others"
        ) from error


def found_mesh(shape: Collision) -> Path:
    """Where a mesh lies: beside the URDF or above it, whatever package or model it is said to be of."""
    scheme, mark, rest = shape.file.partition("://")
    above = [] if shape.beside is None else list(shape.beside.resolve().parents)
    if not mark:
        tries = [*(folder / shape.file for folder in above), Path(shape.file)]
    elif scheme == "file":
        tries = [Path(unquote(rest))]
    else:
        tries = [*(folder / way for folder in above for way in (rest, rest.partition("/")[2])), Path(rest)]
    for path in tries:
        if path.is_file():
            return path
    raise InputError(
        f"mesh {shape.file!r} of link {shape.link!r} was not found next to {shape.beside or 'the text'}; put "
        "it there, or give the robot capsules of your own, robot.with_capsules([...])"
    )


def around(points: FloatArray) -> list[tuple[FloatArray, FloatArray, float, FloatArray]]:
    """Ends, radius and inside of the capsule of least volume around some points, or of two."""
    hull = ConvexHull(points)
    one = _smallest(points)
    if _volume(one) <= SPLIT * hull.volume:
        return [(*one, points)]
    middle, along = 0.5 * (one[0] + one[1]), np.linalg.svd(points - points.mean(axis=0))[2]
    best, inside = [one], [points]
    for axis in along:
        parts = _halves(hull, axis, float(middle @ axis))
        if parts is None:
            continue
        two = [_smallest(part) for part in parts]
        if sum(map(_volume, two)) < min(SAVES * _volume(one), sum(map(_volume, best))):
            best, inside = two, parts
    return [(*capsule, part) for capsule, part in zip(best, inside, strict=True)]


def _halves(hull: Any, axis: FloatArray, at: float) -> list[FloatArray] | None:
    """The corners on both sides of a plane, with those of the cut; None where one side is empty."""
    points, height = hull.points, hull.points @ axis - at
    cut = [
        points[i] + (points[j] - points[i]) * height[i] / (height[i] - height[j])
        for corners in hull.simplices
        for i, j in pairwise([*corners, corners[0]])
        if height[i] * height[j] < 0.0
    ]
    sides = [points[height <= 0.0], points[height >= 0.0]]
    if not cut or min(map(len, sides)) < 1:
        return None
    return [np.vstack([side, cut]) for side in sides]


def _volume(capsule: tuple[FloatArray, FloatArray, float]) -> float:
    a, b, r = capsule
    return float(np.pi * r * r * (np.linalg.norm(b - a) + 4.0 / 3.0 * r))


def _smallest(points: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """By Nelder and Mead over the line of the axis, from each of the principal axes."""
    centre = points.mean(axis=0)
    axes = np.linalg.svd(points - centre, full_matrices=False)[2]
    best, least = None, np.inf
    for axis in axes:
        R = turned_along(axis)
        seen = (points - centre) @ R

        def size(x: FloatArray, seen: FloatArray = seen) -> float:
            return _volume(_at(x, seen))

        scale = float(np.ptp(seen, axis=0).max())
        found = minimize(
            size, np.zeros(4), method="Nelder-Mead",
            options={"xatol": 1e-5 * scale, "fatol": 1e-12, "maxiter": 2000, "initial_simplex":
                np.vstack([np.zeros(4), np.diag([0.2, 0.2, 0.1 * scale, 0.1 * scale])])},
        )  # fmt: skip
        if found.fun < least:
            least = found.fun
            a, b, r = _at(found.x, seen)
            best = R @ a + centre, R @ b + centre, r
    assert best is not None
    return best


def _at(x: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """The capsule about the line through (x2, x3, 0) that leans by x0 and x1, as short as can be."""
    axis = np.array([x[0], x[1], 1.0])
    axis /= np.linalg.norm(axis)
    at = np.array([x[2], x[3], 0.0])
    seen = points - at
    height = seen @ axis
    away = np.einsum("ij,ij->i", seen, seen) - height**2
    r = float(np.sqrt(max(away.max(), 1e-18)))
    spare = np.sqrt(np.maximum(r * r - away, 0.0))
    low, high = float((height + spare).min()), float((height - spare).max())
    if low > high:
        low = high = 0.5 * (low + high)
        r = float(np.sqrt((away + (height - low) ** 2).max()))
    return at + low * axis, at + high * axis, r


def hull_of(points: FloatArray, most: int = CORNERS) -> HullParts:
    """The convex hull of some points, or a body around it."""
    size = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    try:
        hull = ConvexHull(points / size if size > 0.0 else points)
    except (QhullError, ValueError, IndexError) as error:
        raise InputError(
            f"corners are {len(points)} points that have no body between them, expected four or more that "
            "are not in one plane"
        ) from error
    found = _named(hull)
    if len(found.corners) > most:
        found = _around(found, most)
    return HullParts(
        found.corners * size, found.edges, np.hstack([found.faces[:, :3], found.faces[:, 3:] * size])
    )


def _named(hull: Any) -> HullParts:
    """Corners, edges and faces of what qhull has found, whose faces are cut into triangles."""
    sides = _merged(hull)
    used = np.unique(hull.simplices)
    place = np.full(len(hull.points), -1)
    place[used] = np.arange(len(used))
    beside: dict[tuple[int, int], set[int]] = {}
    for triangle, side in zip(hull.simplices, sides, strict=True):
        for a, b in combinations(sorted(place[triangle].tolist()), 2):
            beside.setdefault((a, b), set()).add(int(side))
    edges = [pair for pair, there in beside.items() if len(there) > 1]
    kept = sorted({corner for pair in edges for corner in pair})
    order = {corner: k for k, corner in enumerate(kept)}
    _, first = np.unique(sides, return_index=True)
    faces = hull.equations[first] * np.array([1.0, 1.0, 1.0, -1.0])
    return HullParts(hull.points[used][kept], np.array([(order[a], order[b]) for a, b in edges]), faces)


def _merged(hull: Any) -> IntArray:
    """The number of the face that each triangle belongs to, (F,)."""
    count = len(hull.simplices)
    one, other = np.repeat(np.arange(count), hull.neighbors.shape[1]), hull.neighbors.ravel()
    alike = np.abs(hull.equations[one] - hull.equations[other]).max(axis=1) < SAME
    flat = coo_array((np.ones(int(alike.sum())), (one[alike], other[alike])), shape=(count, count))
    return np.asarray(connected_components(flat, directed=False)[1])


def _around(hull: HullParts, most: int) -> HullParts:
    """A body of some of a hull's own faces: first of those along its box, then of what cuts off most."""
    points, middle = hull.corners, hull.corners.mean(axis=0)
    axes = np.linalg.svd(points - middle, full_matrices=False)[2]
    normals = np.vstack([axes, -axes])
    chosen = np.hstack([normals, (points @ normals.T).max(axis=0)[:, None]])
    found = _between(chosen, middle)
    while True:
        out = (found.corners @ hull.faces[:, :3].T).max(axis=0) - hull.faces[:, 3]
        worst = int(np.argmax(out))
        if out[worst] < CLOSE:
            return found
        chosen = np.vstack([chosen, hull.faces[worst]])
        tried = _between(chosen, middle)
        if len(tried.corners) > most:
            return found
        found = tried


def _between(planes: FloatArray, inside: FloatArray) -> HullParts:
    """The body behind some planes."""
    corners = HalfspaceIntersection(planes * np.array([1.0, 1.0, 1.0, -1.0]), inside).intersections
    return _named(ConvexHull(np.unique(np.round(corners, 12), axis=0)))


def placed_collisions(source: Any) -> list[Collision]:
    """The pieces of a URDF, each with its pose in the world in place of that in its link."""
    found = urdf.read(source, (), ())
    model = found.model
    data, there = model.createData(), frame_names(model)
    pin.forwardKinematics(model, data, pin.neutral(model))
    pin.updateFramePlacements(model, data)
    pieces = []
    for one in found.shapes:
        if isinstance(one, Collision):
            T = data.oMf[model.getFrameId(one.link)].homogeneous if one.link in there else np.eye(4)
            pieces.append(replace(one, place=T @ one.place))
    return pieces
