"""Convex hulls of points, by corners, edges and faces, and simpler bodies around those with many."""

from itertools import combinations
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from ftqp.core.checks import FloatArray, IntArray
from ftqp.core.errors import InputError
from ftqp.model.capsules import HullParts

CORNERS = 64
"""A hull with more corners is replaced by one around it that has at most so many. Around a ball it stands out
by a seventh of its radius then, and by a quarter with 32 (``pytest tests/model/test_convex_hulls.py``)."""
SAME = 1e-9
"""Faces whose normals and offsets differ by less than this, of a hull of length 1, are one. Rounding."""
CLOSE = 1e-3
"""A hull around another one is near enough where it stands out by less than this share of its length. A
convention."""


def hull_of(points: FloatArray, most: int = CORNERS) -> HullParts:
    """The convex hull of some points, or a body around it.

    Args:
        points: (N, 3) [m].
        most: The most corners that it may have. More of them stand out less, and cost more in each tick.
    """
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
