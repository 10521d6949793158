"""Whether an arm may stand in a posture, and whether it may go straight from one to another.

A look asks for joint limits, torques at rest, what is kept, and pairs of bodies: capsules first, and where
they come too near the convex bodies inside. An edge is proven: in a stretch of it each body gets as margin
how far it can be, anywhere in the stretch, from where it is in the middle; a stretch that is not free with
these is halved. Joints that move both bodies of a pair do not count.
Source: Schwarzer, Saha and Latombe 2005.
"""

from math import acos, inf
from typing import Any

import numpy as np

from ftqp.kernel.arm.kinematics import frames, mimic_places, point_of, turned
from ftqp.kernel.jit import carray, jit, part_jit, pointer
from ftqp.kernel.layout.scene_room import HALF_SPACE, HULL, PAIRS, SEGMENT
from ftqp.kernel.layout.ways_room import STRETCHES
from ftqp.kernel.maths.nearest_points import of_segment_and_hull, of_segments, to_body
from ftqp.kernel.maths.side_by_side import joint_sines
from ftqp.kernel.maths.vectors import (
    between,
    cross,
    inner,
    length,
    minus,
    plus,
    rotated_back,
    three,
    times,
    write,
)
from ftqp.kernel.scene.hulls import depth_below, distance_of_hulls, radii_of_pair, refines

FINE = 0.25
"""An edge is known to this share of what is kept ..."""
FINEST = 1e-4
"""... or to this [m], where less is kept. Conventions: one twice as fine takes twice the looks."""
WIDEST = 0.3
"""Stretches in which a body may go farther than this are halved at once [m]. A guess."""
PATIENT = 150
"""An edge is given up after so many looks, so that no slice takes long. A guess that costs none of 70
problems (``python benchmarks/ft_mbm.py``)."""
AT_LIMIT = 1e-9
"""Joints may be beyond their limits by this [rad or m]. Rounding."""
LIMIT_MET, EFFORT_MET, KEEP_MET, BALL_MET = PAIRS, 2 * PAIRS, 3 * PAIRS, 4 * PAIRS
"""What ``obstruction`` adds to one more than the number of a joint, of what is kept and of a body."""
TOO_WIDE = 5 * PAIRS  # the last of HINDRANCES
"""What stands for a stretch in which a body may go farther than ``WIDEST``."""
BALLS_ARE = np.dtype(np.float64)


@jit
def holding_share(K: Any, most: float) -> int:
    """One more than the joint whose motor needs more than this share to hold the arm; 0 where none."""
    W, chain, ahead = K.ways, K.chain, K.ahead
    g = three(chain.gravity)
    for j in range(chain.n):
        m = chain.mass[j]
        W.mass[j] = m
        write(W.moment[j], 0, times(m, point_of(ahead, j, chain.com[j])))
    for j in range(chain.n - 1, -1, -1):
        above, z = chain.parent[j], three(ahead.axis_w[j])
        if chain.prismatic[j]:
            W.torque[j] = -W.mass[j] * inner(z, g)
        else:
            arm = minus(three(W.moment[j]), times(W.mass[j], three(ahead.o[j])))
            W.torque[j] = -inner(z, cross(arm, g))
        if above >= 0:
            W.mass[above] += W.mass[j]
            write(W.moment[above], 0, plus(three(W.moment[above]), three(W.moment[j])))
    for j in range(chain.n):
        l = chain.lead[j]
        if l != j:
            W.torque[l] += chain.ratio[j] * W.torque[j]
    for j in range(chain.n):
        if chain.lead[j] == j and abs(W.torque[j]) > most * W.tau_max[j]:
            return j + 1
    return 0


@jit
def pose_arm(K: Any, q: Any) -> None:
    """Kinematics at a posture."""
    for j in range(K.chain.n):
        K.ahead.q[j] = q[j]
    if K.chain.mimics:
        mimic_places(K.chain, K.ahead.q)
    joint_sines(K.ahead, K.ahead, K.chain)
    frames(K.ahead, K.ahead, K.chain)


@jit
def place_bodies(K: Any) -> None:
    """The ends and middles of all capsules that are looked at."""
    scene, W = K.scene, K.ways
    for c in range(W.bodies):
        if W.is_body[c]:
            a, b = (
                point_of(K.ahead, scene.body[c], scene.end_a[c]),
                point_of(K.ahead, scene.body[c], scene.end_b[c]),
            )
            write(scene.a[c], 0, a)
            write(scene.b[c], 0, b)
            write(W.middle[c], 0, times(0.5, plus(a, b)))


@jit
def _comes_near(K: Any, c: int, o: int, r: float) -> bool:
    """Whether the axis of a capsule comes as near to an obstacle as r.

    The distance f of a point is convex along the axis, so that f(t) + f'(t) (s - t) bounds it from below: it
    ends once it is known on which side of r the least one is.
    """
    scene = K.scene
    a, b, p, turn, size = (
        three(scene.a[c]),
        three(scene.b[c]),
        three(scene.place[o]),
        scene.turn[o],
        scene.extent[o],
    )
    if scene.solid[o] == SEGMENT:
        half = times(size[0], (turn[2], turn[5], turn[8]))
        s, t = of_segments(a, b, minus(p, half), plus(p, half))
        x = minus(between(a, b, s), between(minus(p, half), plus(p, half), t))
        far = r + size[1]
        return far >= 0.0 and inner(x, x) <= far * far
    local, along = rotated_back(turn, minus(a, p)), rotated_back(turn, minus(b, a))
    if scene.solid[o] == HALF_SPACE:
        return min(local[2], local[2] + along[2]) <= r
    if scene.solid[o] == HULL:
        _, d, _ = of_segment_and_hull(scene, o, local, along)
        return d <= r
    low, high, t = 0.0, 1.0, 0.5
    for _ in range(40):
        d, n = to_body(scene.solid[o], size, plus(local, times(t, along)))
        if d <= r:
            return True
        slope = inner(n, along)
        if slope == 0.0 or d + slope * ((low if slope > 0.0 else high) - t) > r:
            return False
        if slope > 0.0:
            high = t + (r - d) / slope
        else:
            low = t + (r - d) / slope
        if low > high:
            return False
        t = 0.5 * (low + high)
    return True


@jit
def _moved(K: Any, body: int, a: Any, b: Any, wide: float, goes: Any) -> float:
    """How far any point of a capsule goes from here at most, while each joint goes ``way`` [m].

    Of the joints between the body and each one, itself among them, it ``goes``. The last joint goes first:
    with d_j that of the joints behind joint j, and r_j from its axis to the capsule's farthest point here,
    d_i = d_j + way_j (r_j + d_j) for i before j. A joint that slides adds its way.
    """
    chain, W, ahead = K.chain, K.ways, K.ahead
    d, j = 0.0, body
    while j >= 0:
        if W.way[j] > 0.0 and chain.prismatic[j]:
            d += W.way[j]
        elif W.way[j] > 0.0:
            o, z = three(ahead.o[j]), three(ahead.axis_w[j])
            r = max(length(cross(minus(a, o), z)), length(cross(minus(b, o), z))) + wide
            d += W.way[j] * (r + d)
        goes[j] = d
        j = chain.parent[j]
    return d


@jit
def _turned(K: Any, body: int) -> float:
    """How far a body turns at most, while each joint goes ``way`` [rad]."""
    d, j = 0.0, body
    while j >= 0:
        d += 0.0 if K.chain.prismatic[j] else K.ways.way[j]
        j = K.chain.parent[j]
    return d


@jit
def know_moved(K: Any) -> float:
    """How far bodies and what is kept go from here at most; the farthest of the bodies."""
    scene, W, keeps, chain, most = K.scene, K.ways, K.keeps, K.chain, 0.0
    for j in range(chain.n):
        if chain.lead[j] != j:
            W.way[j] = abs(chain.ratio[j]) * W.way[chain.lead[j]]
    for c in range(W.bodies):
        if W.is_body[c]:
            a, b = three(scene.a[c]), three(scene.b[c])
            W.moved[c] = _moved(K, scene.body[c], a, b, scene.wide[c], W.goes[c])
            most = max(most, W.moved[c])
    for t in range(keeps.count):
        body = keeps.body[t]
        at = point_of(K.ahead, body, keeps.place[t])
        W.keep_moved[t] = _turned(K, body) if keeps.turns[t] else _moved(K, body, at, at, 0.0, W.row)
    return most


@jit
def goes_of_pair(K: Any, k: int) -> float:
    """How far the bodies of pair k go from each other at most, as ``know_moved`` has it [m]."""
    scene, W, p, r = K.scene, K.ways, K.ways.pair[k], 0.0
    for side in range(2):
        if W.apart[k, side] >= 0:
            r += W.goes[scene.first[p] if side == 0 else scene.second[p], W.apart[k, side]]
    return r


@jit
def _room_of(K: Any, k: int) -> float:
    """How near the bodies of pair k may come here, with what they go from each other [m]."""
    W = K.ways
    return (W.share * W.allow[k] if W.allow[k] > 0.0 else W.allow[k]) + goes_of_pair(K, k)


@jit
def are_capsules_near(K: Any, k: int, r: float) -> bool:
    """Whether the capsules of pair k come as near as r."""
    scene, W = K.scene, K.ways
    p = W.pair[k]
    c, other = scene.first[p], scene.second[p]
    m = three(W.middle[c])
    if other < 0:
        o, far = -1 - other, W.girth[c] + r
        for i in range(3):
            if abs(m[i] - scene.place[o, i]) - W.around[o, i] > far:
                return False
        return _comes_near(K, c, o, scene.wide[c] + r)
    x, far = minus(m, three(W.middle[other])), W.girth[c] + W.girth[other] + r
    if far < 0.0 or inner(x, x) > far * far:
        return False
    a, b, e, f = three(scene.a[c]), three(scene.b[c]), three(scene.a[other]), three(scene.b[other])
    s, t = of_segments(a, b, e, f)
    x = minus(between(a, b, s), between(e, f, t))
    far = scene.wide[c] + scene.wide[other] + r
    return far >= 0.0 and inner(x, x) <= far * far


@jit
def is_pair_near(K: Any, k: int) -> bool:
    """Whether pair k comes nearer than it may, with what its bodies go from each other."""
    scene, p, r = K.scene, K.ways.pair[k], _room_of(K, k)
    c, other = scene.first[p], scene.second[p]
    if not are_capsules_near(K, k, r):
        return False
    if K.ways.allow[k] < 0.0 or not refines(scene, c, other):
        return True
    if other < 0 and scene.solid[-1 - other] == HALF_SPACE:
        height, _ = depth_below(K, c, -1 - other)
        return height <= r
    far = r + radii_of_pair(scene, c, other)
    return far >= 0.0 and distance_of_hulls(K, c, other, far, far, K.ways.parts[k]) <= far


@jit
def kept_distance(K: Any, t: int) -> float:
    """How far what is kept is on its side [m], or inside its cone [rad]."""
    keeps = K.keeps
    body = keeps.body[t]
    if keeps.turns[t]:
        c = inner(turned(K.ahead, body, keeps.place[t]), three(keeps.normal[t]))
        return keeps.offset[t] - acos(min(max(c, -1.0), 1.0))
    return inner(three(keeps.normal[t]), point_of(K.ahead, body, keeps.place[t])) - keeps.offset[t]


@jit
def ball_distance(K: Any, c: int) -> float:
    """How far the capsule of a body is from the nearest ball of a cloud [m]."""
    scene, best = K.scene, inf
    balls = carray(pointer(scene.cloud_at), (scene.cloud, 4), BALLS_ARE)
    a, b = three(scene.a[c]), three(scene.b[c])
    m, size = three(K.ways.middle[c]), K.ways.girth[c]
    for k in range(scene.cloud):
        p = three(balls[k])
        x, far = minus(m, p), best + size + balls[k, 3]
        if inner(x, x) >= far * far:
            continue
        s, _ = of_segments(a, b, p, p)
        best = min(best, length(minus(between(a, b, s), p)) - scene.wide[c] - balls[k, 3])
    return best


@jit
def _balls_met(K: Any) -> int:
    """What ``obstruction`` says of the balls of a cloud."""
    W = K.ways
    for c in range(W.bodies):
        if W.sees_balls[c]:
            allow = W.ball_allow[c]
            r = (W.share * allow if allow > 0.0 else allow) + W.moved[c]
            if ball_distance(K, c) <= r:
                return BALL_MET + c + 1
    return 0


@part_jit
def _met(K: Any, q: Any) -> int:
    """What stands in the way of a posture, as ``obstruction`` says it, while each joint goes ``way``."""
    W, scene = K.ways, K.scene
    W.looks += 1
    for j in range(K.chain.n):
        if W.free[j] and (q[j] < W.q_min[j] - AT_LIMIT or q[j] > W.q_max[j] + AT_LIMIT):
            return LIMIT_MET + j + 1
    pose_arm(K, q)
    if W.weighs:
        heavy = holding_share(K, W.effort)
        if heavy:
            return EFFORT_MET + heavy
    place_bodies(K)
    W.most_moved = know_moved(K)
    if W.most_moved > WIDEST:
        return TOO_WIDE
    for t in range(K.keeps.count):
        if kept_distance(K, t) <= W.keep_allow[t] + W.keep_moved[t]:
            return KEEP_MET + t + 1
    if W.met > 0 and is_pair_near(K, W.met - 1):
        return W.met
    for k in range(W.pairs):
        if is_pair_near(K, k):
            W.met = k + 1
            return k + 1
    return _balls_met(K) if scene.cloud > 0 else 0


@jit
def obstruction(K: Any, q: Any) -> int:
    """What stands in the way of a posture: 0 nothing, a pair and 1, or see ``LIMIT_MET``."""
    for j in range(K.chain.n):
        K.ways.way[j] = 0.0
    return _met(K, q)


@part_jit
def proven(K: Any, c: Any, size: float) -> float:
    """Up to where a way q = c0 + c1 s + c2 s^2 from s = 0 to its size is free, as far as that is known."""
    W, n = K.ways, K.chain.n
    stretch, q, top = W.stretch, W.q, 1
    fine, last = max(FINE * W.share * W.keep, FINEST), W.looks + PATIENT
    stretch[0, 0], stretch[0, 1], W.capped = 0.0, size, 0
    while top > 0:
        top -= 1
        low, high = stretch[top, 0], stretch[top, 1]
        if W.looks >= last:
            W.capped = 1
            return low
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        for j in range(n):
            q[j] = c[0, j] + middle * (c[1, j] + middle * c[2, j])
            W.way[j] = half * max(abs(c[1, j] + 2.0 * low * c[2, j]), abs(c[1, j] + 2.0 * high * c[2, j]))
        if _met(K, q) == 0:
            continue
        most = W.most_moved
        if obstruction(K, q) != 0 or (most > fine and top + 2 > STRETCHES):
            return low
        if most > fine:
            stretch[top, 0], stretch[top, 1] = middle, high
            stretch[top + 1, 0], stretch[top + 1, 1] = low, middle
            top += 2
    return size


@jit
def passes(K: Any, a: Any, b: Any) -> float:
    """The share of the straight way from a to b up to which it is free; 0 where its end is not."""
    line = K.ways.line
    for j in range(K.chain.n):
        line[0, j], line[1, j], line[2, j] = a[j], b[j] - a[j], 0.0
    return proven(K, line, 1.0) if obstruction(K, b) == 0 else 0.0
