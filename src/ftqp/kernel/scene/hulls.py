"""The distance of two convex bodies by their farthest points along directions.

Bodies of an arm are the hulls of their corners, or lines that a radius is taken off later; so are balls and
capsules around them. A simplex of differences of points comes nearer to the origin until no point does.
Source: Gilbert, Johnson and Keerthi 1988; Ericson 2005, "Real-Time Collision Detection", 5.1.5 and 9.5.
"""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.arm.kinematics import point_of
from ftqp.kernel.jit import exact_jit, jit
from ftqp.kernel.layout.scene_room import BLOCK, BOX, CYLINDER, HULL, SEGMENT
from ftqp.kernel.maths.elementary import select
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.maths.side_by_side import largest_of, load_lanes, numbers
from ftqp.kernel.maths.vectors import (
    Vector,
    minus,
    plus,
    rotated,
    rotated_back,
    three,
    three_from,
    times,
    write,
)

ROUNDS = 32
"""So many points are looked for at most; four to eight are usual."""
SAME = 1e-9
"""No point is nearer by more than this share of the squared distance. Rounding."""
FLAT = 1e-12
"""A corner whose height over three others is less than the root of this share is in their plane. Rounding."""


@exact_jit
def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@exact_jit
def _less(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@exact_jit
def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@jit
def has_hull(scene: Any, c: int) -> bool:
    """Whether the convex body in a capsule is known."""
    return bool(scene.hull_of[c, 1] > scene.hull_of[c, 0])


@jit
def refines(scene: Any, c: int, other: int) -> bool:
    """Whether the hulls of a pair are more exact than its capsules."""
    return has_hull(scene, c) or (other >= 0 and has_hull(scene, other))


@jit
def _farthest_corner(corners: Any, first: int, last: int, d: Vector) -> int:
    best, most = first, -inf
    for k in range(first, last):
        s = corners[k, 0] * d[0] + corners[k, 1] * d[1] + corners[k, 2] * d[2]
        if s > most:
            best, most = k, s
    return best


@jit
def _along(corners: Any, at: int, d: Vector) -> Any:
    """How far eight corners of a body are along d."""
    x, y, z = load_lanes(corners[0], at), load_lanes(corners[1], at), load_lanes(corners[2], at)
    return d[0] * x + d[1] * y + d[2] * z


@jit
def _farthest_of_body(corners: Any, first: int, last: int, d: Vector) -> Vector:
    """The same of a body of the arm, whose corners, (3, k), fill blocks of eight."""
    most, best = _along(corners, first, d), numbers(first)
    for at in range(first + BLOCK, last, BLOCK):
        s = _along(corners, at, d)
        best, most = select(s > most, numbers(at), best), select(s > most, s, most)
    k = int(largest_of(select(most >= largest_of(most), best, -1.0)))
    return corners[0, k], corners[1, k], corners[2, k]


@exact_jit
def _farthest(K: Any, t: int, d: Vector) -> Vector:
    """The point of a capsule t, or of an obstacle -1 - t, that is farthest along d, its radius left out."""
    scene = K.scene
    if t >= 0:
        first, last, body = scene.hull_of[t, 0], scene.hull_of[t, 1], scene.body[t]
        if first == last:
            a, b = three(scene.a[t]), three(scene.b[t])
            return a if _dot(a, d) >= _dot(b, d) else b
        local = d if body < 0 else rotated_back(K.ahead.R[body], d)
        return point_of(K.ahead, body, _farthest_of_body(scene.hull_corner, first, last, local))
    o = -1 - t
    turn, e = scene.turn[o], scene.extent[o]
    u = rotated_back(turn, d)
    if scene.solid[o] == HULL:
        k = _farthest_corner(scene.corner, scene.corners_of[o, 0], scene.corners_of[o, 1], u)
        p = three(scene.corner[k])
    elif scene.solid[o] == BOX:
        p = (e[0] if u[0] > 0.0 else -e[0], e[1] if u[1] > 0.0 else -e[1], e[2] if u[2] > 0.0 else -e[2])
    else:
        r = sqrt(u[0] * u[0] + u[1] * u[1])
        s = e[1] / r if scene.solid[o] == CYLINDER and r > 0.0 else 0.0
        p = (s * u[0], s * u[1], e[0] if u[2] > 0.0 else -e[0])
    return plus(three(scene.place[o]), rotated(turn, p))


@exact_jit
def _on_triangle(a: Vector, b: Vector, c: Vector) -> Vector:
    """The shares of a, b and c in the point of their triangle that is nearest to the origin."""
    u, w = _less(b, a), _less(c, a)
    d1, d2, d3, d4 = -_dot(u, a), -_dot(w, a), -_dot(u, b), -_dot(w, b)
    d5, d6 = -_dot(u, c), -_dot(w, c)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        return 1.0, 0.0, 0.0
    if d3 >= 0.0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return 1.0 - d1 / (d1 - d3), d1 / (d1 - d3), 0.0
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return 1.0 - d2 / (d2 - d6), 0.0, d2 / (d2 - d6)
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return 0.0, 1.0 - t, t
    s = va + vb + vc
    return va / s, vb / s, vc / s


@exact_jit
def _mixed(Y: Any, at: int, i: int, j: int, k: int, s: float, t: float, u: float) -> Vector:
    """A point of a simplex, or of one of the bodies, from its shares."""
    a, b = times(s, three_from(Y[i], at)), times(t, three_from(Y[j], at))
    return plus(plus(a, b), times(u, three_from(Y[k], at)))


@exact_jit
def _is_outside(Y: Any, i: int, j: int, k: int, other: int) -> bool:
    """Whether the origin is not on the side of a face where the fourth corner is."""
    a, d = three(Y[i]), _less(three(Y[other]), three(Y[i]))
    n = _cross(_less(three(Y[j]), a), _less(three(Y[k]), a))
    side = _dot(n, d)
    return side * side <= FLAT * _dot(n, n) * _dot(d, d) or -_dot(n, a) * side <= 0.0


@exact_jit
def _nearest_of_simplex(Y: Any, k: int) -> tuple[bool, int, int, int, float, float, float]:
    """Whether the origin is inside k corners; else up to three of them and their shares."""
    if k == 1:
        return False, 0, 0, 0, 1.0, 0.0, 0.0
    if k == 2:
        a, way = three(Y[0]), _less(three(Y[1]), three(Y[0]))
        square = _dot(way, way)
        t = min(max(-_dot(way, a) / square, 0.0), 1.0) if square > 0.0 else 0.0
        return False, 0, 1, 1, 1.0 - t, t, 0.0
    inside, least = k == 4, inf
    found = (0, 1, 2, 1.0, 0.0, 0.0)
    for skip in range(4 if k == 4 else 1):
        i, j, m = 0, 1, 2
        if k == 4:
            i, j, m = (1 if skip == 0 else 0), (1 if skip > 1 else 2), (2 if skip == 3 else 3)
            if not _is_outside(Y, i, j, m, skip):
                continue
            inside = False
        s, t, u = _on_triangle(three(Y[i]), three(Y[j]), three(Y[m]))
        v = _mixed(Y, 0, i, j, m, s, t, u)
        d = _dot(v, v)
        if d < least:
            least, found = d, (i, j, m, s, t, u)
    i, j, m, s, t, u = found
    return inside, i, j, m, s, t, u


@exact_jit
def _keep_share(Y: Any, k: int, i: int, share: float) -> int:
    """Put a corner that has a share to the front; how many there are."""
    if share <= 0.0:
        return k
    assign(Y[k], Y[i], 9)
    Y[k, 9] = share
    return k + 1


@exact_jit
def _middle(scene: Any, t: int) -> Vector:
    return times(0.5, plus(three(scene.a[t]), three(scene.b[t]))) if t >= 0 else three(scene.place[-1 - t])


@exact_jit
def distance_of_hulls(K: Any, c: int, other: int, above: float, below: float, way: Any) -> float:
    """The distance of a capsule's body from another thing, radii left out; 0 where they meet.

    It ends early with a distance that is certain to be more than ``above``, or at most ``below``. Behind it
    ``scene.simplex`` has ``scene.corners`` corners with their shares. It begins along ``way``, from the other
    thing to the body, and leaves there what it has found: what parts them in a place parts them beside it.
    """
    scene = K.scene
    Y, k, last, v = scene.simplex, 0, inf, three(way)
    if _dot(v, v) < SAME * SAME:
        v = _less(_middle(scene, c), _middle(scene, other))
    if _dot(v, v) < SAME * SAME:
        v = (1.0, 0.0, 0.0)
    for _ in range(ROUNDS):
        x, y = _farthest(K, c, times(-1.0, v)), _farthest(K, other, v)
        w = _less(x, y)
        vv, vw = _dot(v, v), _dot(v, w)
        if vw > 0.0 and vw * vw > above * above * vv:
            write(way, 0, v)
            return vw / sqrt(vv)
        if k > 0 and (vv - vw <= SAME * vv or vv >= last):
            break
        last = vv if k > 0 else inf
        write(Y[k], 0, w)
        write(Y[k], 3, x)
        write(Y[k], 6, y)
        inside, i, j, m, s, t, u = _nearest_of_simplex(Y, k + 1)
        v = _mixed(Y, 0, i, j, m, s, t, u)
        if inside or _dot(v, v) <= below * below:
            return 0.0 if inside else sqrt(_dot(v, v))
        k = _keep_share(Y, 0, i, s)  # shares go up in i, j, m, so that nothing is overwritten
        k = _keep_share(Y, k, j, t)
        k = _keep_share(Y, k, m, u) if m != j else k
    scene.corners = k
    if _dot(v, v) > SAME * SAME:
        write(way, 0, v)
    return sqrt(_dot(v, v))


@jit
def radii_of_pair(scene: Any, c: int, other: int) -> float:
    """What is taken off the distance of their hulls, where one is a line [m]."""
    r = 0.0 if has_hull(scene, c) else scene.wide[c]
    if other >= 0:
        return r + (0.0 if has_hull(scene, other) else scene.wide[other])
    return r + (scene.extent[-1 - other, 1] if scene.solid[-1 - other] == SEGMENT else 0.0)


@jit
def nearest_points(scene: Any, near: Any, far: Any) -> None:
    """The points of the two bodies that ``distance_of_hulls`` has found."""
    Y, x, y = scene.simplex, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for k in range(scene.corners):
        x = plus(x, times(Y[k, 9], (Y[k, 3], Y[k, 4], Y[k, 5])))
        y = plus(y, times(Y[k, 9], (Y[k, 6], Y[k, 7], Y[k, 8])))
    write(near, 0, x)
    write(far, 0, y)


@jit
def depth_below(K: Any, c: int, o: int) -> tuple[float, Vector]:
    """The distance of a body's lowest corner from a half-space, and that corner, in W."""
    scene = K.scene
    turn = scene.turn[o]
    n = (turn[2], turn[5], turn[8])
    x = _farthest(K, c, times(-1.0, n))
    d = minus(x, three(scene.place[o]))
    return n[0] * d[0] + n[1] * d[1] + n[2] * d[2], x
