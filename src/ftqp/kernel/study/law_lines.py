"""Straight lines of the tip of a healthy arm, eight at once, and how far the joints stay in a box."""

from math import pi
from typing import Any, Final

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.elementary import any_of, floor, larger, select, smaller, sqrt
from ftqp.kernel.maths.side_by_side import WIDTH, load_lanes, store_lanes
from ftqp.kernel.study.law_rates import TINY, resolve, towards_goal, values, weigh

TURN: Final = 0.05
"""Of all joints together in one substep, at most [rad or m]."""
SUBSTEPS: Final = 400
"""Between two nodes; a line that takes more has failed at a singularity."""
OFF: Final = 1e-6
"""A tip so far from the goal at the end has failed [unit lengths]."""
EDGE: Final = -1e-9
"""A margin from here on counts as inside [rad or m]. Rounding of angles."""
OUTSIDE: Final = -10.0
"""The margin where there is no interval; that of a joint which all values suit is its opposite [rad or m]. A
convention: more than half a turn."""


@jit
def _led_rates(S: Any, L: Any, out: Any) -> Any:
    """dq of a tip that moves as ``wanted``, by the factors that are there, into ``out``; |dq|."""
    for at in range(0, S.study.m * WIDTH, WIDTH):
        store_lanes(L.rhs, at, load_lanes(L.wanted, at))
    return resolve(S, L, L.free, out)


@jit
def _stage(S: Any, L: Any, h: Any, rate: Any, out: Any, seats: int) -> None:
    """The rates h times a rate further."""
    for at in range(0, S.chain.n * WIDTH, WIDTH):
        store_lanes(L.next, at, load_lanes(L.q, at) + h * load_lanes(rate, at))
    values(S, L, L.next, seats)
    weigh(S, L)
    _led_rates(S, L, out)


@jit
def _substeps(S: Any, L: Any, length: Any, pace: Any, seats: int) -> None:
    """From a node to the next: classical Runge-Kutta steps with |dq| <= TURN from the rates in ``k1`` on."""
    left = length
    for _ in range(SUBSTEPS):
        h = smaller(left, TURN / (pace + TINY))
        left = left - h
        _stage(S, L, 0.5 * h, L.k1, L.k2, seats)
        _stage(S, L, 0.5 * h, L.k2, L.k3, seats)
        _stage(S, L, h, L.k3, L.k4, seats)
        sixth = h * (1.0 / 6.0)
        for at in range(0, S.chain.n * WIDTH, WIDTH):
            both = load_lanes(L.k2, at) + load_lanes(L.k3, at)
            move = sixth * (load_lanes(L.k1, at) + 2.0 * both + load_lanes(L.k4, at))
            store_lanes(L.q, at, load_lanes(L.q, at) + move)
        values(S, L, L.q, seats)
        if not any_of(left > 0.0):
            return
        weigh(S, L)
        pace = _led_rates(S, L, L.k1)
    store_lanes(L.failed, 0, select(left > 0.0, 1.0, load_lanes(L.failed, 0)))


@jit
def _onto(S: Any, L: Any, left: float) -> Any:
    """One Newton step onto the node with a share of the way left, then the rates in ``k1`` and |dq|."""
    weigh(S, L)
    for at in range(0, S.study.m * WIDTH, WIDTH):
        store_lanes(L.rhs, at, load_lanes(L.e, at) - left * load_lanes(L.way, at))
    resolve(S, L, L.free, L.k4)
    for at in range(0, S.chain.n * WIDTH, WIDTH):
        store_lanes(L.q, at, load_lanes(L.q, at) + load_lanes(L.k4, at))
    return _led_rates(S, L, L.k1)


@jit
def _margin(L: Any, box: Any, turns: Any, i: int, q: Any) -> Any:
    """How far q_i is inside the intervals of a box, (middle, half width) each; < 0 outside [rad or m]."""
    best = load_lanes(L.zero, 0) + OUTSIDE
    for k in range(L.intervals):
        away = q - box[i, k, 0]
        if turns[i]:
            away = away - 2.0 * pi * floor(away * (0.5 / pi) + 0.5)
        best = larger(best, box[i, k, 1] - abs(away))
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
def _account(S: Any, L: Any, box: Any, turns: Any, weight: Any, first: bool) -> None:
    """The margins at a node into ``margin``, and the length outside since the last one."""
    n = S.chain.n
    of_all = load_lanes(L.zero, 0) - OUTSIDE
    for i in range(n + 1):
        at, now = i * WIDTH, of_all
        if i < n:
            now = _margin(L, box, turns, i, load_lanes(L.q, at))
            of_all = smaller(of_all, now)
        if not first:
            outside = weight * _share_outside(load_lanes(L.margin, at), now)
            store_lanes(L.outside, at, load_lanes(L.outside, at) + outside)
        store_lanes(L.margin, at, now)


@jit
def eight_lines(
    S: Any, L: Any, starts: Any, first: int, last: int, K: int, box: Any, turns: Any, inside: Any,
    failed: Any, q: Any, within: Any,
) -> None:  # fmt: skip
    """Up to eight lines from starts to the goal in K equal parts; rotations are those of the goal all along.

    ``box``: the intervals of each joint as (middle, half width), (n, intervals, 2);
    ``turns``: whether a joint counts modulo one turn. Out: ``inside``, the share of the length with joint i,
    and at last all joints, in the box, (C, n + 1); ``failed``, whether a line ended at a singularity, (C,);
    where somebody asks, ``q`` and ``within`` at the nodes, (C, K + 1, n) and (C, K + 1, n + 1).
    """
    n, m, count = S.chain.n, S.study.m, last - first
    seats, size = (1 << count) - 1, n * WIDTH
    for seat in range(WIDTH):
        L.used[seat] = 1.0 if seat < count else 0.0
        for i in range(n):
            L.q[i * WIDTH + seat] = starts[min(first + seat, last - 1), i]
    L.free[:], L.outside[:], L.failed[:] = 1.0, 0.0, 0.0
    values(S, L, L.q, seats)
    towards_goal(S, L)
    square = load_lanes(L.zero, 0)
    for r in range(m):
        e = (
            load_lanes(L.e, r * WIDTH) * load_lanes(L.used, 0)
            if S.study.rows[r] < 3
            else load_lanes(L.zero, 0)
        )
        square = square + e * e
        store_lanes(L.way, r * WIDTH, e)
    length = sqrt(square)
    for at in range(0, m * WIDTH, WIDTH):
        store_lanes(L.wanted, at, load_lanes(L.way, at) / (length + TINY))
    part, total = length * (1.0 / K), load_lanes(L.zero, 0)
    _account(S, L, box, turns, part, True)
    _keep(S, L, 0, first, last, q, within)
    weigh(S, L)
    pace = _led_rates(S, L, L.k1)
    for k in range(K):
        for at in range(0, size, WIDTH):
            store_lanes(L.trial, at, load_lanes(L.q, at))
        _substeps(S, L, part, pace, seats)
        pace = _onto(S, L, (K - 1.0 - k) / K)
        total = total + part
        _account(S, L, box, turns, part, False)
        _keep(S, L, k + 1, first, last, q, within)
    values(S, L, L.q, seats)
    arrived = towards_goal(S, L) < (OFF * L.unit) ** 2
    store_lanes(L.failed, 0, select(arrived, load_lanes(L.failed, 0), 1.0))
    for i in range(n + 1):
        share = 1.0 - load_lanes(L.outside, i * WIDTH) / (total + TINY)
        store_lanes(L.outside, i * WIDTH, share)
    for seat in range(count):
        failed[first + seat] = int(L.failed[seat])
        for i in range(n + 1):
            inside[first + seat, i] = L.outside[i * WIDTH + seat]


@jit
def _keep(S: Any, L: Any, k: int, first: int, last: int, q: Any, within: Any) -> None:
    """What is known at node k, where somebody asks."""
    n = S.chain.n
    if len(q) == 0:
        return
    for seat in range(last - first):
        for i in range(n):
            q[first + seat, k, i] = L.q[i * WIDTH + seat]
        for i in range(n + 1):
            within[first + seat, k, i] = 1 if L.margin[i * WIDTH + seat] >= EDGE else 0


@jit
def lines(
    S: Any, L: Any, starts: Any, parts: int, box: Any, turns: Any, inside: Any, failed: Any, q: Any,
    within: Any, first: int, last: int,
) -> None:  # fmt: skip
    """Lines ``first`` to ``last - 1`` of a healthy arm, each in so many parts."""
    for at in range(first, last, WIDTH):
        eight_lines(S, L, starts, at, min(at + WIDTH, last), parts, box, turns, inside, failed, q, within)
