"""Nearest points of segments, and of a segment and a convex body.

Source: Ericson 2005, "Real-Time Collision Detection", 5.1.9, for two segments; that the signed distance to a
convex body is a convex function of the point makes the other a search for the sign of one derivative.

Nearest points of a segment and a convex hull that has corners, edges and faces.

Outside, a point is nearest to the face that it is farthest above, if it stands over it; else some edge is
nearest. Inside, the distance is that to the nearest face, and the deepest point of the segment is where two
lines of a convex, piecewise linear function meet.
Source: Boyd and Vandenberghe 2004, "Convex Optimization", 8.1.3, for the face that is nearest; Ericson 2005,
"Real-Time Collision Detection", 5.3.8, for the part of a segment within planes.
"""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.scene_room import BOX, HALF_SPACE
from ftqp.kernel.maths.vectors import Vector, between, inner, length, minus, plus, three, times

PARALLEL = 1e-12
"""Segments whose sine squared is below this are parallel: rounding leaves some 1e-16 of it."""
POINT = 1e-24
"""A segment shorter than the root of this is a point [m2]. Rounding."""
ALONG = 1e-9
"""Where the distance grows by less than this along a segment it is parallel to the surface. Seven digits
above rounding."""
SEARCHES = 60
"""How often a search halves at most: a double has no more digits."""
FINE = 1e-11
"""A search ends where its bracket is narrower than this share of the segment: the distance is then found to
1e-11 of it at an edge, and to rounding elsewhere."""


@jit
def _clamped(x: float) -> float:
    return min(max(x, 0.0), 1.0)


@jit
def of_segments(a: Vector, b: Vector, c: Vector, d: Vector) -> tuple[float, float]:
    """The shares s and t at which a + s (b - a) and c + t (d - c) are nearest; parallel: the middle."""
    u, w, r = minus(b, a), minus(d, c), minus(a, c)
    uu, ww, ur, wr = inner(u, u), inner(w, w), inner(u, r), inner(w, r)
    if uu <= POINT and ww <= POINT:
        return 0.0, 0.0
    if uu <= POINT:
        return 0.0, _clamped(wr / ww)
    if ww <= POINT:
        return _clamped(-ur / uu), 0.0
    uw = inner(u, w)
    sine = uu * ww - uw * uw
    if sine > PARALLEL * uu * ww:
        s = _clamped((uw * wr - ur * ww) / sine)
    else:
        low, high = -ur / uu, (uw - ur) / uu
        low, high = max(min(low, high), 0.0), min(max(low, high), 1.0)
        s = 0.5 * (low + high) if low <= high else (0.0 if high < 0.0 else 1.0)
    t = (uw * s + wr) / ww
    if t < 0.0:
        return _clamped(-ur / uu), 0.0
    if t > 1.0:
        return _clamped((uw - ur) / uu), 1.0
    return s, t


@jit
def to_body(shape: int, size: Any, p: Vector) -> tuple[float, Vector]:
    """Signed distance of a point to a body in the body's own frame, and the direction in which it grows."""
    x, y, z = p
    if shape == HALF_SPACE:
        return z, (0.0, 0.0, 1.0)
    if shape == BOX:
        e0, e1, e2 = abs(x) - size[0], abs(y) - size[1], abs(z) - size[2]
        s0, s1, s2 = (1.0 if x >= 0.0 else -1.0), (1.0 if y >= 0.0 else -1.0), (1.0 if z >= 0.0 else -1.0)
        if e0 <= 0.0 and e1 <= 0.0 and e2 <= 0.0:
            if e0 >= e1 and e0 >= e2:
                return e0, (s0, 0.0, 0.0)
            return (e1, (0.0, s1, 0.0)) if e1 >= e2 else (e2, (0.0, 0.0, s2))
        e0, e1, e2 = max(e0, 0.0), max(e1, 0.0), max(e2, 0.0)
        d = length((e0, e1, e2))
        return d, (s0 * e0 / d, s1 * e1 / d, s2 * e2 / d)
    r = sqrt(x * x + y * y)
    c, s = (x / r, y / r) if r > 0.0 else (1.0, 0.0)
    over, beyond, side = r - size[1], abs(z) - size[0], (1.0 if z >= 0.0 else -1.0)
    if over <= 0.0 and beyond <= 0.0:
        return (over, (c, s, 0.0)) if over >= beyond else (beyond, (0.0, 0.0, side))
    over, beyond = max(over, 0.0), max(beyond, 0.0)
    d = sqrt(over * over + beyond * beyond)
    return d, (c * over / d, s * over / d, side * beyond / d)


@jit
def _rise(shape: int, size: Any, p: Vector, u: Vector) -> float:
    """How the distance to a body grows along u at a point."""
    _, n = to_body(shape, size, p)
    return inner(n, u)


@jit
def _first_from(shape: int, size: Any, p: Vector, u: Vector, level: float) -> float:
    """The least share t at which the distance of p + t u grows by ``level`` or more along u; 1 if nowhere."""
    low, f_low = 0.0, _rise(shape, size, p, u) - level
    if f_low >= 0.0:
        return 0.0
    high, f_high = 1.0, _rise(shape, size, plus(p, u), u) - level
    if f_high < 0.0:
        return 1.0
    for k in range(SEARCHES):
        if high - low <= FINE:
            break
        t = 0.5 * (low + high)
        if k % 3 != 2 and f_high > f_low:
            t = min(max(low - f_low * (high - low) / (f_high - f_low), low + 0.5 * FINE), high - 0.5 * FINE)
        f = _rise(shape, size, plus(p, times(t, u)), u) - level
        if f < 0.0:
            low, f_low = t, f
            f_high *= 0.5
        else:
            high, f_high = t, f
            f_low *= 0.5
    return 0.5 * (low + high)


@jit
def of_segment_and_body(shape: int, size: Any, p: Vector, u: Vector) -> float:
    """The share t at which p + t u, in the body's own frame, is nearest to it; the middle of all that are."""
    slope = ALONG * length(u)
    if slope <= ALONG * sqrt(POINT):
        return 0.0
    return 0.5 * (_first_from(shape, size, p, u, -slope) + _first_from(shape, size, p, u, slope))


OVER = 1e-12
"""A point stands over a face up to this [m]. Rounding."""
EVEN = 1e-9
"""A segment whose ends are as high above a face up to this share of its length lies along it. Seven digits
above rounding."""
THIN = 1e-9
"""Nearest points that are closer than this have no direction between them [m]. Rounding."""


@jit
def _highest(scene: Any, o: int, p: Vector) -> tuple[float, int]:
    """The height of a point above the face that it is farthest above, and that face."""
    height, which = -inf, -1
    for f in range(scene.faces_of[o, 0], scene.faces_of[o, 1]):
        h = inner(three(scene.face[f]), p) - scene.face[f, 3]
        if h > height:
            height, which = h, f
    return height, which


@jit
def _enters(scene: Any, o: int, p: Vector, u: Vector) -> bool:
    """Whether any of p + t u, 0 <= t <= 1, is within every face."""
    low, high = 0.0, 1.0
    for f in range(scene.faces_of[o, 0], scene.faces_of[o, 1]):
        n = three(scene.face[f])
        h, slope = inner(n, p) - scene.face[f, 3], inner(n, u)
        if slope > 0.0:
            high = min(high, -h / slope)
        elif slope < 0.0:
            low = max(low, -h / slope)
        elif h > 0.0:
            return False
    return low <= high


@jit
def _deepest(scene: Any, o: int, p: Vector, u: Vector) -> tuple[float, float, int]:
    """The share t at which p + t u is deepest inside, its height, <= 0, and the face that is nearest."""
    low, high = 0.0, 1.0
    h_low, f_low = _highest(scene, o, p)
    h_high, f_high = _highest(scene, o, plus(p, u))
    t, h, f = (low, h_low, f_low) if h_low <= h_high else (high, h_high, f_high)
    for _ in range(scene.faces_of[o, 1] - scene.faces_of[o, 0]):
        s_low, s_high = inner(three(scene.face[f_low]), u), inner(three(scene.face[f_high]), u)
        if s_low >= 0.0 or s_high <= 0.0 or high <= low:
            break  # it does not fall from there
        t = (h_high - h_low + s_low * low - s_high * high) / (s_low - s_high)
        t = min(max(t, low), high)
        line = h_low + s_low * (t - low)
        h, f = _highest(scene, o, plus(p, times(t, u)))
        if h <= line + OVER:
            break
        if inner(three(scene.face[f]), u) < 0.0:
            low, h_low, f_low = t, h, f
        else:
            high, h_high, f_high = t, h, f
    return t, h, f


@jit
def _stands_over(scene: Any, o: int, p: Vector, height: float, which: int) -> bool:
    """Whether a point is above a face itself, and not beside it."""
    top, _ = _highest(scene, o, minus(p, times(height, three(scene.face[which]))))
    return top <= OVER


@jit
def of_segment_and_hull(scene: Any, o: int, p: Vector, u: Vector) -> tuple[float, float, Vector]:
    """The share t at which p + t u is nearest to a hull or deepest in it, the signed distance, the normal."""
    if _enters(scene, o, p, u):
        t, depth, f = _deepest(scene, o, p, u)
        return t, depth, three(scene.face[f])
    end = plus(p, u)
    first, f_first = _highest(scene, o, p)
    last, f_last = _highest(scene, o, end)
    best, t, n = inf, 0.0, (0.0, 0.0, 1.0)
    over = first > 0.0 and _stands_over(scene, o, p, first, f_first)
    if over:
        best, t, n = first, 0.0, three(scene.face[f_first])
    if last > 0.0 and _stands_over(scene, o, end, last, f_last):
        if over and f_first == f_last and abs(first - last) <= EVEN * length(u):
            t = 0.5
        elif last < best:
            best, t, n = last, 1.0, three(scene.face[f_last])
    for e in range(scene.edges_of[o, 0], scene.edges_of[o, 1]):
        c, d = three(scene.corner[scene.edge[e, 0]]), three(scene.corner[scene.edge[e, 1]])
        s, r = of_segments(p, end, c, d)
        there = plus(p, times(s, u))
        w = minus(there, between(c, d, r))
        away = length(w)
        if away < best:
            best, t = away, s
            if away > THIN:
                n = (w[0] / away, w[1] / away, w[2] / away)
            else:
                _, f = _highest(scene, o, there)
                n = three(scene.face[f])
    return t, best, n
