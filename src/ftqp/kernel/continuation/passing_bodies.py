"""Bodies that an arm comes near to after a failure: how near, and the rows that keep it off.

Source: docs/theory/coverage.md, "Among obstacles".
"""

from math import inf
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.rows import CLEARANCES
from ftqp.kernel.layout.thresholds import LAST
from ftqp.kernel.scene.clearance import add_gradient, distance_of_pair, place_capsules


@jit
def forget_clearance(S: Any, C: Any) -> None:
    """Begin a motion, for which no pair has been measured."""
    scene = S.scene
    C.clearance, scene.way = inf, 0.0
    for p in range(scene.pairs):
        scene.gap[p] = -inf


@jit
def note_clearance(S: Any, C: Any) -> bool:
    """Take the least distance at ``state.q`` into the worst one; False where a pair is too near.

    It is, where it is nearer than is to be kept by more than the tip may be off. A pair comes nearer by no
    more than everything has moved since it was measured, so most need not be measured anew.
    """
    scene = S.scene
    if scene.pairs == 0:
        return True
    _go_on(S)
    placed = False
    for p in range(scene.pairs):
        if scene.gap[p] - scene.way < C.clearance:
            if not placed:
                place_capsules(S)
                placed = True
            C.clearance = min(C.clearance, _measured(S, p))
    return bool(C.clearance >= scene.keep - C.near)


@jit
def nearest_distance(S: Any) -> float:
    """The least distance of all pairs at ``state.q``, inf without any [m]."""
    scene = S.scene
    _go_on(S)
    place_capsules(S)
    least = inf
    for p in range(scene.pairs):
        least = min(least, _measured(S, p))
    return least


@jit
def _go_on(S: Any) -> None:
    """Make ``state.q`` the posture ``ahead``, and note by how far anything may have moved on the way."""
    scene, ahead = S.scene, S.ahead
    for j in range(S.chain.n):
        scene.way += abs(S.state.q[j] - ahead.q[j]) * scene.joint_way[j]
        ahead.q[j] = S.state.q[j]


@jit
def _measured(S: Any, p: int) -> float:
    """The distance of a pair, capsules being placed."""
    scene = S.scene
    d = distance_of_pair(S, p, scene.normal, scene.near, scene.far)
    scene.gap[p] = d + scene.way
    return d


@jit
def _far_from(S: Any, Q: Any) -> float:
    """How much nearer any pair can come in one sample at most [m]."""
    way = 0.0
    for j in range(S.chain.n):
        way += S.scene.joint_way[j] * max(abs(Q.lb[j]), abs(Q.ub[j]))
    return way  # a joint moves one body of a pair, or both alike


@jit
def pose_clearance(S: Any, C: Any) -> None:
    """G x >= -caution (d - keep) of pairs that may come too near in this sample, the nearest ones first.

    ``caution`` is the share of the way to a limit that one sample may take, and the same here. What is too
    near already is led apart. A row gives way where box and failed joints leave it no choice.
    """
    Q, scene, n = C.qp, S.scene, S.chain.n
    Q.nc, Q.rigid, Q.yields_from, Q.soft_rows, Q.soft_last = 0, 0, 0, 0.0, LAST
    if scene.pairs == 0:
        return
    reach, placed = _far_from(S, Q), False
    for p in range(scene.pairs):
        if C.caution * (scene.gap[p] - scene.way - scene.keep) > reach:
            continue
        if not placed:
            place_capsules(S)
            placed = True
        x = _measured(S, p) - scene.keep
        add_gradient(S, p, scene.normal, scene.near, scene.far, scene.row)
        fastest = 0.0
        for j in range(n):
            fastest += max(-scene.row[j] * Q.lb[j], -scene.row[j] * Q.ub[j])
        if C.caution * x > fastest:
            continue
        k = _row_for(Q, scene.spare, x)
        if k < 0:
            continue
        scene.spare[k] = x
        Q.l[k], Q.u[k] = -C.caution * x, inf
        for j in range(n):
            Q.C[k, j] = scene.row[j]


@jit
def _row_for(Q: Any, spare: Any, x: float) -> int:
    """A row for a pair: a new one, or that of the farthest that has one; -1 where all are nearer."""
    if Q.nc < CLEARANCES:
        Q.nc += 1
        return Q.nc - 1
    farthest = 0
    for k in range(1, CLEARANCES):
        if spare[k] > spare[farthest]:
            farthest = k
    return farthest if spare[farthest] > x else -1
