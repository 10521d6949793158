"""How near bodies of the arm come to each other and to what stands around it, and the rows that part them.

A row says that the distance d of a pair at the predicted posture, whose gradient is G, falls no faster than
can be braked:

    G v' >= n'v_o - phi(d - keep),   phi(x) = min(k x, the largest speed that stops within x),

v' the velocity after the tick, v_o that of the obstacle, n the way from it. What brakes is a share of what
the joints that work can do along G. Where the arm is too fast already, as a joint may just have failed, the
row asks for what they can do in the tick, and no more. Of a cloud of balls, as a camera sees a room, each
body of an arm looks at the few that matter to it.
Source: docs/theory/clearance.md.
"""

from math import cos, inf, sin
from typing import Any

import numpy as np

from ftqp.kernel.arm.kinematics import fold_row, frames, moves, point_column, point_of
from ftqp.kernel.jit import carray, jit, part_jit, pointer
from ftqp.kernel.latches.settling import latch
from ftqp.kernel.layout.enums import ACCELERATION, STOPPED_BY_CLEARANCE, STOPPED_BY_SCENE
from ftqp.kernel.layout.rows import CLEARANCES
from ftqp.kernel.layout.scene_room import HALF_SPACE, HULL, NEAREST, SEGMENT
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.maths.nearest_points import of_segment_and_body, of_segment_and_hull, of_segments, to_body
from ftqp.kernel.maths.side_by_side import joint_sines
from ftqp.kernel.maths.vectors import (
    Vector,
    add_to,
    between,
    cross,
    inner,
    length,
    minus,
    plus,
    rotated,
    rotated_back,
    three,
    three_from,
    times,
    write,
)
from ftqp.kernel.rows.joint_intervals import braking_velocity
from ftqp.kernel.scene.hulls import depth_below, distance_of_hulls, nearest_points, radii_of_pair, refines

VERSION_IS = np.dtype(np.int64)


@jit
def is_watched(scene: Any) -> bool:
    """Whether the pairs are those of the scene as it is now, and there are some where anything stands."""
    if scene.version_at != 0:
        now = carray(pointer(scene.version_at), (1,), VERSION_IS)
        if now[0] != scene.version:
            return False
    return bool(scene.pairs > 0 or scene.things == 0)


@jit
def stop_unwatched(scene: Any, watch: Any) -> None:
    """Stop an arm beside a scene that is not watched."""
    if watch.latched == 0 and not is_watched(scene):
        latch(watch, STOPPED_BY_SCENE)


BALLS_ARE = np.dtype(np.float64)
MOVED = 5e-3
"""Balls are chosen anew once anything has gone so far [m]. A guess, a quarter of the usual clearance."""
OFTEN = 20
"""They are chosen anew after so many ticks at most. A convention."""
NOWHERE = 1e6
"""A ball that is not there is so far away [m]. A convention."""


@part_jit
def choose_balls(K: Any) -> None:
    """Let the slots of each body stand for the balls that are nearest to it, each apart from the others.

    A ball beside a nearer one that was chosen is passed over: the row of that one holds for it, too, and the
    slots reach along the body. A ball that stays chosen keeps its slot.
    """
    scene, taken = K.scene, K.scene.taken
    balls = carray(pointer(scene.cloud_at), (scene.cloud, 4), BALLS_ARE)
    scene.chosen_tick, scene.chosen_way = K.state.ticks, scene.way
    for p in range(scene.cloud_pair, scene.pairs, NEAREST):
        _measure_all(scene, scene.first[p], balls)
        for s in range(NEAREST):
            taken[s] = _nearest_left(scene, balls)
        _assign(scene, p, balls)


@jit
def _measure_all(scene: Any, c: int, balls: Any) -> None:
    """The distances of all balls from a body."""
    a, b = three(scene.a[c]), three(scene.b[c])
    for k in range(scene.cloud):
        point = three(balls[k])
        s, _ = of_segments(a, b, point, point)
        away = length(minus(between(a, b, s), point))
        scene.away[k] = away - scene.wide[c] - balls[k, 3]


@jit
def _nearest_left(scene: Any, balls: Any) -> int:
    """The nearest ball that is left, which takes those beside it away; -1 where none is left."""
    best, least = -1, inf
    for k in range(scene.cloud):
        if scene.away[k] < least:
            best, least = k, scene.away[k]
    if best >= 0:
        beside = 2.0 * balls[best, 3]
        for k in range(scene.cloud):
            x = minus(three(balls[k]), three(balls[best]))
            if inner(x, x) <= beside * beside:
                scene.away[k] = inf
    return best


@jit
def _assign(scene: Any, first: int, balls: Any) -> None:
    """Put the chosen balls into the slots of a body, those that were there before where they were."""
    taken = scene.taken
    for s in range(NEAREST):
        o, stays = -1 - scene.second[first + s], False
        for t in range(NEAREST):
            if taken[t] >= 0 and taken[t] == scene.ball[o]:
                taken[t], stays = -1, True
        if not stays:
            scene.ball[o] = -1
    for s in range(NEAREST):
        p = first + s
        o = -1 - scene.second[p]
        if scene.ball[o] >= 0:
            continue
        new = -1
        for t in range(NEAREST):
            if taken[t] >= 0:
                new, taken[t] = taken[t], -1
                break
        scene.ball[o] = new
        for i in range(3):
            scene.place[o, i] = balls[new, i] if new >= 0 else NOWHERE
        scene.extent[o, 0], scene.extent[o, 1] = 0.0, balls[new, 3] if new >= 0 else 0.0
        scene.look[p], scene.gap[p] = 0, -inf


@jit
def is_stale(K: Any) -> bool:
    """Whether balls are to be chosen anew."""
    scene = K.scene
    late = K.state.ticks - scene.chosen_tick >= OFTEN or K.state.ticks < scene.chosen_tick
    return bool(late or abs(scene.way - scene.chosen_way) > MOVED)


@jit
def turn_by(R: Any, w: Vector) -> None:
    """R <- exp(w) R, for nine numbers by rows and a rotation vector w along W [rad] (Rodrigues)."""
    angle = length(w)
    if angle == 0.0:
        return
    c, s = cos(angle), sin(angle)
    k = (w[0] / angle, w[1] / angle, w[2] / angle)
    for j in range(3):
        x = (R[j], R[3 + j], R[6 + j])
        along = inner(k, x) * (1.0 - c)
        x = plus(plus(times(c, x), times(s, cross(k, x))), times(along, k))
        R[j], R[3 + j], R[6 + j] = x


TOUCHING = 1e-9
"""Axes that are nearer than this have no direction between them [m]; upwards is taken then. Rounding."""
PARTING = 0.1
"""Bodies that are nearer than they may be are led apart at no more than this [m/s]."""
LEAST_BRAKE = 0.05
"""What a pair is braked by at least [m/s2], however few joints move it."""
UNSEEN = 20
"""A pair is looked at again after so many ticks at most, however far it is. A convention."""
FAR = 10.0
"""No part of an arm is farther from where a half-space turns about [m]. A convention."""
STILL = 1e-3
"""Bodies that approach each other more slowly than this are not said to approach [m/s]."""


@jit
def _place(ahead: Any, scene: Any, c: int) -> None:
    """The ends of a capsule at the posture ``ahead.q``, once for it."""
    if scene.stamped[c] == scene.stamp:
        return
    scene.stamped[c] = scene.stamp
    write(scene.a[c], 0, point_of(ahead, scene.body[c], scene.end_a[c]))
    write(scene.b[c], 0, point_of(ahead, scene.body[c], scene.end_b[c]))


@jit
def _bodies_ahead(chain: Any, ahead: Any, scene: Any) -> None:
    """Kinematics at the posture ``ahead.q``, at which no capsule is placed yet."""
    joint_sines(ahead, ahead, chain)
    frames(ahead, ahead, chain)
    scene.stamp += 1


@jit
def _place_all(K: Any) -> None:
    """The ends of all capsules at the posture ``ahead.q``."""
    for c in range(K.scene.capsules):
        _place(K.ahead, K.scene, c)


@jit
def place_capsules(K: Any) -> None:
    """Kinematics at the posture ``ahead.q``, and the ends of all capsules there."""
    _bodies_ahead(K.chain, K.ahead, K.scene)
    _place_all(K)


@jit
def _see_ahead(K: Any) -> None:
    """The predicted posture, and by how far anything may have gone since the last tick."""
    state, chain, ahead, scene = K.state, K.chain, K.ahead, K.scene
    dt = state.dt if state.level == ACCELERATION else 0.0
    way = 0.0
    for j in range(chain.n):
        q = state.q[j] + dt * state.v[j]
        way += abs(q - ahead.q[j]) * scene.joint_way[j]
        ahead.q[j] = q
    scene.way += way
    _bodies_ahead(chain, ahead, scene)


@jit
def _move_obstacles(state: Any, scene: Any) -> None:
    """Obstacles go on as fast as they were said to; by how far they have gone at most."""
    fastest = 0.0
    for o in range(scene.obstacles):
        w = scene.twist[o]
        if w[0] == 0.0 and w[1] == 0.0 and w[2] == 0.0 and w[3] == 0.0 and w[4] == 0.0 and w[5] == 0.0:
            continue
        v, turn = three(w), three_from(w, 3)
        add_to(scene.place[o], 0, times(state.dt, v))
        turn_by(scene.turn[o], times(state.dt, turn))
        reach = FAR if scene.solid[o] == HALF_SPACE else length(three(scene.extent[o]))
        fastest = max(fastest, length(v) + reach * length(turn))
    scene.way += state.dt * fastest


@jit
def _between_axes(a: Vector, b: Vector, e: Vector, f: Vector, n: Any, near: Any, far: Any) -> float:
    """The distance of two axes, the nearest points of both, and the way from the second to the first."""
    s, t = of_segments(a, b, e, f)
    write(near, 0, between(a, b, s))
    write(far, 0, between(e, f, t))
    x = minus(three(near), three(far))
    d = length(x)
    write(n, 0, (x[0] / d, x[1] / d, x[2] / d) if d > TOUCHING else (0.0, 0.0, 1.0))
    return d


@jit
def distance_of_pair(K: Any, p: int, n: Any, near: Any, far: Any) -> float:
    """The distance of pair p; n points from the second to the first, ``near`` and ``far`` to both."""
    scene = K.scene
    d = distance_of_capsules(K, p, n, near, far)
    return refined_distance(K, p, d, n, near, far) if refines(scene, scene.first[p], scene.second[p]) else d


@jit
def refined_distance(K: Any, p: int, d: float, n: Any, near: Any, far: Any) -> float:
    """The distance of the hulls of pair p, whose capsules are at d, and its points; d where they meet."""
    scene = K.scene
    c, other = scene.first[p], scene.second[p]
    if other < 0 and scene.solid[-1 - other] == HALF_SPACE:
        height, lowest = depth_below(K, c, -1 - other)
        write(near, 0, lowest)
        write(far, 0, minus(lowest, times(height, three(n))))
        return height
    apart = distance_of_hulls(K, c, other, inf, 0.0, n)
    if apart <= TOUCHING:
        return d
    nearest_points(scene, near, far)
    x = minus(three(near), three(far))
    write(n, 0, (x[0] / apart, x[1] / apart, x[2] / apart))
    return apart - radii_of_pair(scene, c, other)


@jit
def distance_of_capsules(K: Any, p: int, n: Any, near: Any, far: Any) -> float:
    """The distance of the capsules of pair p; n, and ``near`` and ``far`` on their axes."""
    scene = K.scene
    c, other = scene.first[p], scene.second[p]
    a, b = three(scene.a[c]), three(scene.b[c])
    if other >= 0:
        d = _between_axes(a, b, three(scene.a[other]), three(scene.b[other]), n, near, far)
        return d - scene.wide[c] - scene.wide[other]
    o = -1 - other
    place, turn, size = three(scene.place[o]), scene.turn[o], scene.extent[o]
    if scene.solid[o] == SEGMENT:
        half = times(size[0], (turn[2], turn[5], turn[8]))
        d = _between_axes(a, b, minus(place, half), plus(place, half), n, near, far)
        return d - scene.wide[c] - size[1]
    local, along = rotated_back(turn, minus(a, place)), rotated_back(turn, minus(b, a))
    if scene.solid[o] == HULL:
        t, d, normal = of_segment_and_hull(scene, o, local, along)
    else:
        t = of_segment_and_body(scene.solid[o], size, local, along)
        d, normal = to_body(scene.solid[o], size, plus(local, times(t, along)))
    write(n, 0, rotated(turn, normal))
    write(near, 0, between(a, b, t))
    write(far, 0, minus(three(near), times(d, three(n))))
    return d - scene.wide[c]


@jit
def _add_columns(K: Any, body: int, p: Any, n: Any, sign: float, row: Any) -> None:
    """row += sign n'J of a point of the arm at the predicted posture."""
    ahead, chain = K.ahead, K.chain
    for j in range(body + 1):
        if moves(chain, j, body):
            row[j] += sign * inner(three(n), point_column(ahead, chain, j, three(p)))


@jit
def add_gradient(K: Any, p: int, n: Any, near: Any, far: Any, row: Any) -> None:
    """The gradient of the distance of pair p by the joints, as ``distance_of_pair`` has left the points."""
    scene = K.scene
    row[: K.chain.n] = 0.0
    _add_columns(K, scene.body[scene.first[p]], near, n, 1.0, row)
    other = scene.second[p]
    if other >= 0:
        _add_columns(K, scene.body[other], far, n, -1.0, row)


@jit
def _place_of(scene: Any, p: int, spare: float) -> int:
    """The slot of a pair: its own, an empty one, or that of a pair that needs it less; -1 where none does."""
    empty, least = -1, -1
    for k in range(CLEARANCES):
        if scene.slot[k] == p:
            return k
        if scene.slot[k] < 0:
            empty = k if empty < 0 else empty
        elif scene.spare[k] > spare and (least < 0 or scene.spare[k] > scene.spare[least]):
            least = k
    return empty if empty >= 0 else least


@jit
def approach_speed(scene: Any, x: float, brake: float, dt: float) -> float:
    """How fast bodies may come nearer that have x left [m/s]; negative where they are to part."""
    return max(scene.gain * x, -PARTING) if x < 0.0 else min(scene.gain * x, braking_velocity(x, brake, dt))


@jit
def _pose(K: Any, p: int, d: float, n: Any, near: Any, far: Any) -> None:
    """The row of a pair, if it may hold the arm back in this tick, and when it is to be looked at again."""
    scene, state, chain, faults, limits = K.scene, K.state, K.chain, K.faults, K.limits
    row, dt = scene.row, K.state.dt
    add_gradient(K, p, n, near, far, row)
    other, towards = scene.second[p], 0.0
    if other < 0:
        w, lever = scene.twist[-1 - other], minus(three(far), three(scene.place[-1 - other]))
        towards = inner(three(n), plus(three(w), cross(three_from(w, 3), lever)))
    if chain.mimics:
        fold_row(chain, row)
    moving = full = brake = most = 0.0
    for j in range(chain.n):
        moving += row[j] * state.v[j]
        most += abs(row[j]) * limits.a_max[j]  # of those that are being braked, too
    for k in range(faults.working):
        j = faults.order[k]
        full += abs(row[j]) * limits.a_max[j]
        brake += abs(row[j]) * limits.a_brake[j]
    brake = max(scene.share * brake, LEAST_BRAKE)
    rate, x = moving - towards, d - scene.keep
    may = approach_speed(scene, x, brake, dt)
    spare = rate + may
    if p == scene.nearest:
        scene.closing = 1 if rate < -STILL else 0
    reach = 2.0 * most * dt
    free = faults.movable > faults.working
    grows = 2.0 * (most + scene.gain * abs(may))
    wait = 1.0
    if spare > reach and not free and towards == 0.0 and grows > 0.0:
        wait = max(min((spare - reach) / (grows * dt), float(UNSEEN)), 1.0)
    scene.look[p] = state.ticks + int(wait)
    if spare > reach:
        return
    k = _place_of(scene, p, spare)
    if k < 0 or (scene.met[k] and scene.slot[k] != p):
        scene.crowded = 1  # this pair, or the one that it displaces, goes without a row
    if k < 0:
        return
    scene.slot[k], scene.spare[k], scene.met[k] = p, spare, 1
    least = min(towards - may, moving + full * dt)
    scene.least[k] = (least - moving) / dt if state.level == ACCELERATION else least
    assign(scene.G[k], row, chain.n)


@jit
def _look_at(K: Any, p: int) -> None:
    """Measure a pair, and pose its row."""
    scene = K.scene
    n, near, far = scene.normal, scene.near, scene.far
    _place(K.ahead, scene, scene.first[p])
    if scene.second[p] >= 0:
        _place(K.ahead, scene, scene.second[p])
    d = distance_of_pair(K, p, n, near, far)
    scene.gap[p] = d + scene.way
    if d < scene.distance:
        scene.distance, scene.nearest = d, p
    _pose(K, p, d, n, near, far)


@jit
def measure(K: Any, q: Any, out: Any) -> None:
    """The distances of all pairs at a posture."""
    scene = K.scene
    assign(K.ahead.q, q, K.chain.n)
    place_capsules(K)
    if scene.cloud > 0:
        choose_balls(K)
    for p in range(scene.pairs):
        out[p] = distance_of_pair(K, p, scene.normal, scene.near, scene.far)


@part_jit
def look_around(K: Any) -> None:
    """The distances of all pairs that matter now, and the rows of those that may hold the arm back.

    A pair is looked at when its row may be needed, or when it may be the nearest: no pair comes nearer by
    more than everything together has moved since it was looked at. A pair that falls below ``halt`` while it
    still comes nearer stops the arm.
    """
    scene, state, watch = K.scene, K.state, K.watch
    _move_obstacles(state, scene)
    _see_ahead(K)
    if scene.cloud > 0 and is_stale(K):
        _place_all(K)
        choose_balls(K)
    scene.met[:CLEARANCES] = 0
    last = scene.nearest
    scene.distance, scene.nearest, scene.closing, scene.crowded = inf, last, 0, 0
    if last >= 0:
        _look_at(K, last)
    for p in range(scene.pairs):
        if p != last and (state.ticks >= scene.look[p] or scene.gap[p] - scene.way < scene.distance):
            _look_at(K, p)
    scene.held = 0
    for k in range(CLEARANCES):
        if scene.met[k] == 0:
            scene.slot[k] = -1
        elif scene.slot[k] >= 0:
            scene.held += 1
    if scene.distance < scene.halt and scene.closing and watch.latched == 0:
        latch(watch, STOPPED_BY_CLEARANCE)


@jit
def measure_all(K: Any, q: Any, out: Any) -> None:
    """The distance of every pair at each of S postures, (S, n) into (S, pairs)."""
    for k in range(len(q)):
        measure(K, q[k], out[k])
