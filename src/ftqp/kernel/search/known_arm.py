"""What a search knows of an arm, its limits and what is around: all as a planner believes it.

The rooms ``chain``, ``scene`` and ``keeps`` are the planner's to the byte; all else is taken over here.
"""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.arm.kinematics import moves
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import HEALTHY
from ftqp.kernel.layout.scene_room import BOX, CAPSULES, CYLINDER, HALF_SPACE, HULL, SEGMENT
from ftqp.kernel.maths.vectors import length, minus, three
from ftqp.kernel.scene.clearance import distance_of_pair
from ftqp.kernel.search.looks import (
    FINEST,
    are_capsules_near,
    ball_distance,
    holding_share,
    kept_distance,
    place_bodies,
    pose_arm,
)

SURELY = 0.9
"""Motors that hold an arm in any posture with this share of their limits are strong enough. A convention."""
ALONE = 1e-2
"""What is kept where no bodies are, so that edges are looked at as finely [m]. A convention."""


@jit
def _may_be_too_heavy(K: Any) -> bool:
    """Whether any posture may ask more of a motor than it has; joints that slide may."""
    chain, W = K.chain, K.ways
    g = length(three(chain.gravity))
    for j in range(chain.n):
        W.torque[j] = 0.0
    for k in range(chain.n):
        far, j = chain.lever[k], k
        while j >= 0:
            lead = chain.lead[j]
            ratio = 1.0 if lead == j else abs(chain.ratio[j])
            W.torque[lead] += ratio * chain.mass[k] * (1.0 if chain.prismatic[j] else far)
            far += chain.span[j]
            if chain.prismatic[j]:
                far += max(abs(W.q_min[j]), abs(W.q_max[j]))
            j = chain.parent[j]
    for j in range(chain.n):
        if g * W.torque[j] > SURELY * W.tau_max[j]:
            return True
    return False


@jit
def _choose_pairs(K: Any) -> None:
    """Pairs of whole bodies, and of the ends of those that half-spaces are apart from."""
    scene, W = K.scene, K.ways
    count = scene.cloud_pair if scene.cloud > 0 else scene.pairs
    for c in range(CAPSULES):
        W.is_body[c] = W.sees_balls[c] = 0
    W.pairs = W.bodies = 0
    for p in range(scene.pairs):
        c, other = scene.first[p], scene.second[p]
        if p >= count:
            W.is_body[c] = W.sees_balls[c] = 1
        elif c < scene.whole or (other < 0 and scene.solid[-1 - other] == HALF_SPACE):
            W.pair[W.pairs] = p
            W.pairs += 1
            W.is_body[c] = 1
            if other >= 0:
                W.is_body[other] = 1
    for c in range(CAPSULES):
        if W.is_body[c]:
            W.bodies = c + 1


@part_jit
def know_arm(K: Any, P: Any) -> None:
    """Take over what a planner believes of its joints, and which pairs of its scene count."""
    W, chain, limits = K.ways, K.chain, P.limits
    for j in range(chain.n):
        works = P.faults.code[j] == HEALTHY
        W.q_min[j], W.q_max[j], W.v_max[j] = limits.q_min[j], limits.q_max[j], limits.v_max[j]
        W.a_max[j], W.tau_max[j] = limits.a_brake[j], limits.tau_max[j] if works else inf
        W.free[j] = 1 if works and chain.lead[j] == j else 0
    for k in range(9):
        W.tool[k] = P.task.axis[k]
    W.weighs = 1 if chain.has_inertia and _may_be_too_heavy(K) else 0
    W.keep, W.share = K.scene.keep if K.scene.pairs > 0 else ALONE, 1.0
    _choose_pairs(K)


@jit
def _apart(K: Any, body: int, other: int) -> int:
    """The first joint on the way to a body that does not move another one; -1: none, -1 is the base."""
    chain, first, j = K.chain, -1, body
    while j >= 0 and not (other >= 0 and moves(chain, j, other)):
        first, j = j, chain.parent[j]
    return first


@jit
def _box_around(K: Any, o: int) -> None:
    """Half the edges of a box along W around an obstacle."""
    scene, box, turn, e = K.scene, K.ways.around[o], K.scene.turn[o], K.scene.extent[o]
    for i in range(3):
        x, y, z = abs(turn[3 * i]), abs(turn[3 * i + 1]), abs(turn[3 * i + 2])
        if scene.solid[o] == SEGMENT:
            box[i] = z * e[0] + e[1]
        elif scene.solid[o] == CYLINDER:
            box[i] = z * e[0] + e[1] * sqrt(max(1.0 - z * z, 0.0))
        elif scene.solid[o] == BOX or scene.solid[o] == HULL:
            box[i] = x * e[0] + y * e[1] + z * e[2]
        else:
            box[i] = inf


@jit
def know_surroundings(K: Any, q: Any) -> None:
    """Sizes of all bodies, boxes around obstacles, and how far pairs are apart at the start.

    Who is nearer than is kept, or weaker than the torque limits ask, may be so on the way.
    """
    W, scene, chain, keeps = K.ways, K.scene, K.chain, K.keeps
    for c in range(W.bodies):
        if W.is_body[c]:
            W.girth[c] = 0.5 * length(minus(three(scene.end_b[c]), three(scene.end_a[c]))) + scene.wide[c]
    for o in range(scene.obstacles):
        _box_around(K, o)
    pose_arm(K, q)
    place_bodies(K)
    for k in range(W.pairs):
        W.parts[k, 0] = W.parts[k, 1] = W.parts[k, 2] = 0.0
        p = W.pair[k]
        body, other = scene.body[scene.first[p]], -1
        if scene.second[p] >= 0:
            other = scene.body[scene.second[p]]
        W.apart[k, 0], W.apart[k, 1] = _apart(K, body, other), _apart(K, other, body)
        W.allow[k] = W.keep
        if are_capsules_near(K, k, W.keep + FINEST):
            W.allow[k] = min(W.keep, distance_of_pair(K, p, W.normal, W.one, W.other) - FINEST)
    for t in range(keeps.count):
        W.keep_allow[t] = min(0.0, kept_distance(K, t) - FINEST)
    for c in range(W.bodies):
        if W.sees_balls[c]:
            W.ball_allow[c] = min(W.keep, ball_distance(K, c) - FINEST)
    if W.weighs:
        while holding_share(K, W.effort) and W.effort < 1e6:
            W.effort *= 1.02
    for j in range(chain.n):
        W.q_min[j], W.q_max[j] = min(W.q_min[j], q[j]), max(W.q_max[j], q[j])
