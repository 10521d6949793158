"""A cloud of balls, as a camera sees a room: each body of an arm looks at the few of them that matter to it.

Source: docs/theory/clearance.md, "A cloud of balls".
"""

from math import inf, sqrt
from typing import Any

import numpy as np

from ftqp.kernel.jit import carray, jit, part_jit, pointer
from ftqp.kernel.layout.scene_room import NEAREST
from ftqp.kernel.maths.nearest_points import of_segments

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
    a, b, point = scene.a[c], scene.b[c], scene.local
    for k in range(scene.cloud):
        for i in range(3):
            point[i] = balls[k, i]
        s, _ = of_segments(a, b, point, point)
        x = a[0] + s * (b[0] - a[0]) - point[0]
        y = a[1] + s * (b[1] - a[1]) - point[1]
        z = a[2] + s * (b[2] - a[2]) - point[2]
        scene.away[k] = sqrt(x * x + y * y + z * z) - scene.wide[c] - balls[k, 3]


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
            x, y = balls[k, 0] - balls[best, 0], balls[k, 1] - balls[best, 1]
            z = balls[k, 2] - balls[best, 2]
            if x * x + y * y + z * z <= beside * beside:
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
