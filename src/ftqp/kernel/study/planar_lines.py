"""Straight lines of the tip of a healthy planar arm, eight at once, and how far the joints stay in boxes."""

from collections.abc import Callable
from math import pi
from typing import Any, Final

import numpy as np

from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.layout.planar_memory import INTERVALS, planar_dtype
from ftqp.kernel.maths.elementary import any_of, floor, larger, select, smaller, sqrt
from ftqp.kernel.maths.side_by_side import WIDTH, put, several
from ftqp.kernel.study.planar_arm import TINY, levers, weighted

TURN: Final = 0.05
"""Of all joints together in one substep, at most [rad]."""
SUBSTEPS: Final = 400
"""Between two nodes; a line that takes more has failed at a singularity."""
OFF: Final = 1e-6
"""A tip so far from its node after the correction has failed [mean link lengths]."""
EDGE: Final = -1e-9
"""A margin from here on counts as inside [rad]."""
FLOAT, WHOLE = np.dtype(np.float64), np.dtype(np.int64)


@jit
def _rates(P: Any, q: Any, ux: Any, uy: Any, out: Any) -> Any:
    """dq of a tip that moves by u, M J' A^-1 u, into ``out``; |dq|^2."""
    levers(P, q)
    return _resolved(P, ux, uy, out)


@jit
def _resolved(P: Any, ux: Any, uy: Any, out: Any) -> Any:
    """The same with the levers that are there."""
    a, b, d = weighted(P)
    inverse = 1.0 / (a * d - b * b + TINY)
    along, across = (d * ux - b * uy) * inverse, (a * uy - b * ux) * inverse
    size = several(P.zero, 0)
    for at in range(0, len(P.q), WIDTH):
        rate = several(P.mx, at) * along + several(P.my, at) * across
        size = size + rate * rate
        put(out, at, rate)
    return size


@jit
def _substeps(P: Any, length: Any, ux: Any, uy: Any, pace: Any) -> None:
    """From a node to the next: classical Runge-Kutta steps with |dq| <= TURN from the rates in ``k1`` on."""
    size = len(P.q)
    left = length
    for count in range(SUBSTEPS):
        h = smaller(left, TURN / (sqrt(pace) + TINY))
        left = left - h
        for at in range(0, size, WIDTH):
            put(P.next, at, several(P.q, at) + 0.5 * h * several(P.k1, at))
        _rates(P, P.next, ux, uy, P.k2)
        for at in range(0, size, WIDTH):
            put(P.next, at, several(P.q, at) + 0.5 * h * several(P.k2, at))
        _rates(P, P.next, ux, uy, P.k3)
        for at in range(0, size, WIDTH):
            put(P.next, at, several(P.q, at) + h * several(P.k3, at))
        _rates(P, P.next, ux, uy, P.k4)
        sixth = h * (1.0 / 6.0)
        for at in range(0, size, WIDTH):
            both = several(P.k2, at) + several(P.k3, at)
            move = sixth * (several(P.k1, at) + 2.0 * both + several(P.k4, at))
            put(P.q, at, several(P.q, at) + move)
        if not any_of(left > 0.0):
            return
        if count + 1 < SUBSTEPS:
            pace = _rates(P, P.q, ux, uy, P.k1)
    put(P.failed, 0, select(left > 0.0, 1.0, several(P.failed, 0)))


@jit
def _onto(P: Any, x: Any, y: Any) -> None:
    """One Newton step with the levers that are there onto the node (x, y)."""
    ex, ey = x - several(P.px, 0), y - several(P.py, 0)
    _resolved(P, ex, ey, P.k4)
    for at in range(0, len(P.q), WIDTH):
        put(P.q, at, several(P.q, at) + several(P.k4, at))


@jit
def margin_of(P: Any, box: int, i: int, q: Any) -> Any:
    """How far q_i is inside the intervals of a box, < 0 outside [rad]; intervals are (middle, half width)."""
    best = several(P.zero, 0) - 10.0
    for k in range(INTERVALS):
        turned = q - P.box[box, i, k, 0]
        turned = turned - 2.0 * pi * floor(turned * (0.5 / pi) + 0.5)
        best = larger(best, P.box[box, i, k, 1] - abs(turned))
    return best


@jit
def _share_outside(before: Any, now: Any) -> Any:
    """The share of a segment that is outside, of the margins at its ends."""
    crossing = before / (before - now + TINY)
    inside = select(
        before >= EDGE,
        select(now >= EDGE, 1.0, crossing),
        select(now >= EDGE, 1.0 - crossing, 0.0),
    )
    return 1.0 - smaller(larger(inside, 0.0), 1.0)


@jit
def _account(P: Any, weight: Any, first: bool) -> None:
    """The margins at a node into ``margin``, and the length outside since the last one."""
    n = len(P.link)
    common = several(P.zero, 0) - 10.0
    for box in range(P.boxes):
        of_all = several(P.zero, 0) + 10.0
        for i in range(n):
            of_all = smaller(of_all, margin_of(P, box, i, several(P.q, i * WIDTH)))
        common = larger(common, of_all)
    for i in range(n + 1):
        at = i * WIDTH
        now = common
        if i < n:
            now = margin_of(P, 0, i, several(P.q, at))
            for box in range(1, P.boxes):
                now = larger(now, margin_of(P, box, i, several(P.q, at)))
        if not first:
            outside = weight * _share_outside(several(P.margin, at), now)
            put(P.outside, at, several(P.outside, at) + outside)
        put(P.margin, at, now)


@jit
def eight_lines(P: Any, starts: Any, first: int, last: int, K: int, inside: Any, failed: Any, q: Any,
                within: Any) -> None:  # fmt: skip
    """Up to eight lines from starts to the goal in K equal parts.

    Args:
        P: The memory.
        starts: Configurations, (C, n) [rad].
        first: The first start.
        last: Behind the last start.
        K: Parts of a line.
        inside: Out: the share of the length with joint i, and at last all joints, in the boxes, (C, n + 1).
        failed: Out: whether the line ended at a singularity, (C,).
        q: Out: the configurations at the nodes, (C, K + 1, n) [rad]; empty where nobody asks.
        within: Out: whether the margins at the nodes are not negative, (C, K + 1, n + 1); empty likewise.
    """
    n, size = len(P.link), len(P.q)
    for seat in range(WIDTH):
        for i in range(n):
            P.q[i * WIDTH + seat] = starts[min(first + seat, last - 1), i]
    P.outside[:] = 0.0
    P.failed[:] = 0.0
    levers(P, P.q)
    x, y = several(P.px, 0), several(P.py, 0)
    ux, uy = P.goal[0] - x, P.goal[1] - y
    length = sqrt(ux * ux + uy * uy)
    ux, uy = ux / (length + TINY), uy / (length + TINY)
    part = length * (1.0 / K)
    _account(P, part, True)
    _keep(P, 0, first, last, q, within)
    total = several(P.zero, 0)
    pace = _rates(P, P.q, ux, uy, P.k1)
    for k in range(K):
        for at in range(0, size, WIDTH):
            put(P.trial, at, several(P.q, at))
        _substeps(P, part, ux, uy, pace)
        gone = part * (k + 1.0)
        levers(P, P.q)
        _onto(P, x + ux * gone, y + uy * gone)
        pace = _resolved(P, ux, uy, P.k1)
        weight = part
        if P.by_joints:
            turned = several(P.zero, 0)
            for at in range(0, size, WIDTH):
                move = several(P.q, at) - several(P.trial, at)
                turned = turned + move * move
            weight = sqrt(turned)
        total = total + weight
        _account(P, weight, False)
        _keep(P, k + 1, first, last, q, within)
    levers(P, P.q)
    ex, ey = P.goal[0] - several(P.px, 0), P.goal[1] - several(P.py, 0)
    arrived = ex * ex + ey * ey < OFF * OFF
    put(P.failed, 0, select(arrived, several(P.failed, 0), 1.0))
    for i in range(n + 1):
        share = 1.0 - several(P.outside, i * WIDTH) / (total + TINY)
        put(P.outside, i * WIDTH, share)
    for seat in range(min(WIDTH, last - first)):
        failed[first + seat] = int(P.failed[seat])
        for i in range(n + 1):
            inside[first + seat, i] = P.outside[i * WIDTH + seat]


@jit
def _keep(P: Any, k: int, first: int, last: int, q: Any, within: Any) -> None:
    """What is known at node k, where somebody asks."""
    n = len(P.link)
    if len(q) == 0:
        return
    for seat in range(min(WIDTH, last - first)):
        for i in range(n):
            q[first + seat, k, i] = P.q[i * WIDTH + seat]
        for i in range(n + 1):
            within[first + seat, k, i] = 1 if P.margin[i * WIDTH + seat] >= EDGE else 0


def planar_lines(n: int) -> Callable[..., int]:
    """Straight lines of a healthy arm of n joints."""
    dtype = planar_dtype(n)
    small = np.dtype(np.int8)

    def planar_lines(memory_at: int, table_at: int, first: int, last: int) -> int:
        """Lines ``first`` to ``last - 1``.

        The table holds the number of all starts, K, whether nodes are kept, and the addresses of starts,
        inside, failed, q and within.
        """
        P = carray(pointer(memory_at), 1, dtype)[0]
        table = carray(pointer(table_at), (8,), WHOLE)
        count, K, kept = table[0], table[1], table[0] * table[2]
        starts = carray(pointer(table[3]), (count, n), FLOAT)
        inside = carray(pointer(table[4]), (count, n + 1), FLOAT)
        failed = carray(pointer(table[5]), (count,), WHOLE)
        q = carray(pointer(table[6]), (kept, K + 1, n), FLOAT)
        within = carray(pointer(table[7]), (kept, K + 1, n + 1), small)
        for at in range(first, last, WIDTH):
            eight_lines(P, starts, at, min(at + WIDTH, last), K, inside, failed, q, within)
        return 0

    return planar_lines
