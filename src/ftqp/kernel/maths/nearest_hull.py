"""Nearest points of a segment and a convex hull that has corners, edges and faces.

Outside, a point is nearest to the face that it is farthest above, if it stands over it; else some edge is
nearest. Inside, the distance is that to the nearest face, and the deepest point of the segment is where two
lines of a convex, piecewise linear function meet.
Source: Boyd and Vandenberghe 2004, "Convex Optimization", 8.1.3, for the face that is nearest; Ericson 2005,
"Real-Time Collision Detection", 5.3.8, for the part of a segment within planes.
"""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.nearest_points import of_segments

OVER = 1e-12
"""A point stands over a face up to this [m]. Rounding."""
EVEN = 1e-9
"""A segment whose ends are as high above a face up to this share of its length lies along it. Seven digits
above rounding."""
THIN = 1e-9
"""Nearest points that are closer than this have no direction between them [m]. Rounding."""


@jit
def _highest(scene: Any, o: int, x: float, y: float, z: float) -> tuple[float, int]:
    """The height of a point above the face that it is farthest above, and that face."""
    height, which = -inf, -1
    for f in range(scene.faces_of[o, 0], scene.faces_of[o, 1]):
        face = scene.face[f]
        h = face[0] * x + face[1] * y + face[2] * z - face[3]
        if h > height:
            height, which = h, f
    return height, which


@jit
def _enters(scene: Any, o: int, p: Any, u: Any) -> bool:
    """Whether any of p + t u, 0 <= t <= 1, is within every face."""
    low, high = 0.0, 1.0
    for f in range(scene.faces_of[o, 0], scene.faces_of[o, 1]):
        face = scene.face[f]
        h = face[0] * p[0] + face[1] * p[1] + face[2] * p[2] - face[3]
        slope = face[0] * u[0] + face[1] * u[1] + face[2] * u[2]
        if slope > 0.0:
            high = min(high, -h / slope)
        elif slope < 0.0:
            low = max(low, -h / slope)
        elif h > 0.0:
            return False
    return low <= high


@jit
def _deepest(scene: Any, o: int, p: Any, u: Any) -> tuple[float, float, int]:
    """The share t at which p + t u is deepest inside, its height, <= 0, and the face that is nearest."""
    low, high = 0.0, 1.0
    h_low, f_low = _highest(scene, o, p[0], p[1], p[2])
    h_high, f_high = _highest(scene, o, p[0] + u[0], p[1] + u[1], p[2] + u[2])
    t, h, f = (low, h_low, f_low) if h_low <= h_high else (high, h_high, f_high)
    for _ in range(scene.faces_of[o, 1] - scene.faces_of[o, 0]):
        one, other = scene.face[f_low], scene.face[f_high]
        s_low = one[0] * u[0] + one[1] * u[1] + one[2] * u[2]
        s_high = other[0] * u[0] + other[1] * u[1] + other[2] * u[2]
        if s_low >= 0.0 or s_high <= 0.0 or high <= low:
            break  # it does not fall from there
        t = (h_high - h_low + s_low * low - s_high * high) / (s_low - s_high)
        t = min(max(t, low), high)
        line = h_low + s_low * (t - low)
        h, f = _highest(scene, o, p[0] + t * u[0], p[1] + t * u[1], p[2] + t * u[2])
        if h <= line + OVER:
            break
        face = scene.face[f]
        if face[0] * u[0] + face[1] * u[1] + face[2] * u[2] < 0.0:
            low, h_low, f_low = t, h, f
        else:
            high, h_high, f_high = t, h, f
    return t, h, f


@jit
def _stands_over(scene: Any, o: int, x: float, y: float, z: float, height: float, which: int) -> bool:
    """Whether a point is above a face itself, and not beside it."""
    n = scene.face[which]
    top, _ = _highest(scene, o, x - height * n[0], y - height * n[1], z - height * n[2])
    return top <= OVER


@jit
def of_segment_and_hull(scene: Any, o: int, p: Any, u: Any) -> tuple[float, float, float, float, float]:
    """The share t at which p + t u is nearest to a hull or deepest in it, its signed distance and the normal.

    All is in the hull's own frame. Of a segment along a face the middle is taken.

    Args:
        scene: The room of the scene.
        o: Which obstacle.
        p: One end of the segment, (3,) [m].
        u: The way to its other end, (3,) [m].
    """
    if _enters(scene, o, p, u):
        t, d, f = _deepest(scene, o, p, u)
        face = scene.face[f]
        return t, d, face[0], face[1], face[2]
    x, y, z = p[0] + u[0], p[1] + u[1], p[2] + u[2]
    first, f_first = _highest(scene, o, p[0], p[1], p[2])
    last, f_last = _highest(scene, o, x, y, z)
    best, t, n0, n1, n2 = inf, 0.0, 0.0, 0.0, 1.0
    over = first > 0.0 and _stands_over(scene, o, p[0], p[1], p[2], first, f_first)
    if over:
        face = scene.face[f_first]
        best, t, n0, n1, n2 = first, 0.0, face[0], face[1], face[2]
    if last > 0.0 and _stands_over(scene, o, x, y, z, last, f_last):
        length = sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
        if over and f_first == f_last and abs(first - last) <= EVEN * length:
            t = 0.5
        elif last < best:
            face = scene.face[f_last]
            best, t, n0, n1, n2 = last, 1.0, face[0], face[1], face[2]
    end = (x, y, z)
    for e in range(scene.edges_of[o, 0], scene.edges_of[o, 1]):
        c, d = scene.corner[scene.edge[e, 0]], scene.corner[scene.edge[e, 1]]
        s, r = of_segments(p, end, c, d)
        w0 = p[0] + s * u[0] - c[0] - r * (d[0] - c[0])
        w1 = p[1] + s * u[1] - c[1] - r * (d[1] - c[1])
        w2 = p[2] + s * u[2] - c[2] - r * (d[2] - c[2])
        away = sqrt(w0 * w0 + w1 * w1 + w2 * w2)
        if away < best:
            best, t = away, s
            if away > THIN:
                n0, n1, n2 = w0 / away, w1 / away, w2 / away
            else:
                _, f = _highest(scene, o, p[0] + s * u[0], p[1] + s * u[1], p[2] + s * u[2])
                n0, n1, n2 = scene.face[f, 0], scene.face[f, 1], scene.face[f, 2]
    return t, best, n0, n1, n2
