"""Where the motion after a lock ends: the goal, another rest, or a singularity that lies ahead.

Source: docs/theory/after-a-failure.md, "How a run ends".
"""

from math import sqrt
from typing import Any, Final

from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import CORRECT, ERRONEOUS, SINGULAR, TASK_ROWS
from ftqp.kernel.layout.other_records import SHARE
from ftqp.kernel.maths.elementary import select
from ftqp.kernel.maths.linear_systems import lu_factor, lu_solve
from ftqp.kernel.maths.side_by_side import WIDTH, put, several
from ftqp.kernel.study.law_rates import (
    factor,
    rates,
    rates_at,
    rates_in_eight,
    resolve,
    solve,
    towards_goal,
    values,
)

SQUARINGS: Final = 24
"""Of the Cayley transform, until its powers have grown or died."""


@jit
def dies_out(L: Any, k: int) -> bool:
    """Whether all eigenvalues of ``slope``, (k, k), have negative real parts; the slopes are lost.

    Of two unknowns by det > 0 and trace < 0, of more by the powers of the Cayley transform
    C = (s - S)^-1 (s + S): they die out just where S is stable, as |(s + x)/(s - x)| < 1 where Re x < 0.
    """
    S, B = L.slope, L.work
    if k == 1:
        return S[0, 0] < 0.0
    if k == 2:
        return S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0] > 0.0 and S[0, 0] + S[1, 1] < 0.0
    scale = largest_of(S, k)
    if not scale > 0.0:
        return False
    for i in range(k):
        for j in range(k):
            B[i, j] = (scale if i == j else 0.0) - S[i, j]
            S[i, j] += scale if i == j else 0.0
    if not lu_factor(B, k, L.pivots):
        return False
    for j in range(k):
        for i in range(k):
            L.y[i] = S[i, j]
        lu_solve(B, k, L.pivots, L.y)
        for i in range(k):
            S[i, j] = L.y[i]
    for _ in range(SQUARINGS):
        size = 0.0
        for i in range(k):
            for j in range(k):
                s = 0.0
                for l in range(k):
                    s += S[i, l] * S[l, j]
                B[i, j] = s
                size += s * s
        for i in range(k):
            for j in range(k):
                S[i, j] = B[i, j]
        if not size < 1e30:
            return False
        if size < 1e-6:
            return True
    return sqrt(size) < 1e-3


@jit
def largest_of(S: Any, k: int) -> float:
    """The largest entry of S, (k, k), without its sign."""
    scale = 0.0
    for i in range(k):
        for j in range(k):
            scale = max(scale, abs(S[i, j]))
    return scale


MOVING: Final = -1
"""Not at an end, as far as is known."""
NEAR: Final = 5e-2
"""From this |e| on the goal is looked for [unit lengths]."""
REACH: Final = 5e-2
"""An end that is further away from a run than this is not taken for its own [rad]."""
GOAL_SEARCHES: Final = 4
"""Newton steps: from ``NEAR`` on the error falls below 1e-12 where the Jacobian is regular."""
FOUND: Final = 1e-9
"""The |e| at which a configuration counts as one at the goal [unit lengths]. Newton's steps from ``NEAR`` end
far below it, rounding included."""
SEARCHES: Final = 12
"""Newton steps to a rest, at most."""
STILL: Final = 1e-9
"""A Newton step this short has converged [rad]. The next one would be rounding."""
AT_GOAL: Final = 1e-6
"""|e| at a rest that counts as the goal [unit lengths]."""
SLOW: Final = 3e-2
"""Below this |dq/ds| rest is looked for."""
RESTING: Final = 1e-7
"""A motion this slow with gain 1 has come to rest, though there may be rests beside it [rad/s]."""
NEUTRAL: Final = 1e-6
"""An eigenvalue whose real part is this small beside the slopes, or beside 1, belongs to a curve of rests."""
DIFFERENCE: Final = 1e-6
"""Of slopes by central differences [rad or m]. Between the rounding of slopes and what they bend: a
convention."""
AT_ONCE: Final = (WIDTH - 1) // 2
"""Joints whose differences have room beside the configuration itself."""
FLAT: Final = 1e-10
"""Least pivot of B over the largest up to which the arm at the goal is singular, and the goal not taken.
Above rounding; a guess that tests/kernel/study/test_law_runs.py has not contradicted."""
NEARLY_FLAT: Final = 1e-5
"""The same from which a singularity ahead is looked for ..."""
TRULY_FLAT: Final = 1e-12
"""... and of one that takes a motion in. Rounding, and a guess that tests/kernel/study/test_law_runs.py has
not contradicted."""
FIRST: Final = 1e-9
LAST: Final = 2.0 * REACH
FINER: Final = 60
"""How far behind a singularity the field is looked at [rad], and by how many halvings it is found."""


@jit
def goal_ahead(S: Any, L: Any, q: Any, free: Any, reach: Any, seats: int) -> None:
    """Search the goal from q with the joints that move, within ``reach``; ends in ``trial``.

    ``found`` is 1 where there is one; where fewer joints than rows move, the goal is found as a rest only. It
    draws the arm if the motion e' = -A I_S G e dies out, whose matrix, turned into B^-1 (A I_S P), goes into
    ``turned``.
    """
    n, m = S.chain.n, S.study.m
    for at in range(0, n * WIDTH, WIDTH):
        put(L.trial, at, several(q, at))
    for _ in range(GOAL_SEARCHES):
        values(S, L, L.trial, seats)
        for r in range(m):
            for i in range(n):
                at = (r * n + i) * WIDTH
                put(L.P, at, several(L.A, at) * several(free, i * WIDTH))
        factor(S, L)
        towards_goal(S, L)
        resolve(S, L, free, L.next)
        for at in range(0, n * WIDTH, WIDTH):
            put(L.trial, at, several(L.trial, at) + several(L.next, at))
    error, _, regular = rates(S, L, L.trial, free, L.next, seats)
    way = several(L.zero, 0)
    for at in range(0, n * WIDTH, WIDTH):
        move = several(L.trial, at) - several(q, at)
        way = way + move * move
    for c in range(m):
        for r in range(m):
            s = several(L.zero, 0)
            for i in range(n):
                moves = several(free, i * WIDTH) * several(L.P, (c * n + i) * WIDTH)
                s = s + several(L.A, (r * n + i) * WIDTH) * moves
            put(L.rhs, r * WIDTH, s)
        solve(S, L)
        for r in range(m):
            put(L.turned, (r * TASK_ROWS + c) * WIDTH, several(L.rhs, r * WIDTH))
    bound = FOUND * L.unit
    there = (error < bound * bound) & (way < reach * reach) & (regular > FLAT)
    put(L.found, 0, select(there, 1.0, 0.0))


@jit
def draws(S: Any, L: Any, seat: int) -> bool:
    """Whether the goal that a run has found draws the arm."""
    m = S.study.m
    for r in range(m):
        for c in range(m):
            L.slope[r, c] = -L.turned[(r * TASK_ROWS + c) * WIDTH + seat]
    return dies_out(L, m)


@jit
def put_slopes(S: Any, L: Any, q: Any) -> None:
    """dv/dq at q, (n,), of the joints that move into ``slope``, by central differences, three at a time.

    v there is in ``v``, and its facts in ``one_``, as of ``rates_at``.
    """
    n, k = S.chain.n, L.moves
    for first in range(0, k, AT_ONCE):
        last = min(first + AT_ONCE, k)
        for i in range(n):
            L.eight[i * WIDTH : (i + 1) * WIDTH] = q[i]
        for l in range(first, last):
            at = L.moving[l] * WIDTH + 1 + 2 * (l - first)
            L.eight[at] += DIFFERENCE
            L.eight[at + 1] -= DIFFERENCE
        rates_in_eight(S, L, L.v, 1 + 2 * (last - first))
        for l in range(first, last):
            for i in range(k):
                at = L.moving[i] * WIDTH + 1 + 2 * (l - first)
                L.slope[i, l] = (L.eight_rate[at] - L.eight_rate[at + 1]) / (2.0 * DIFFERENCE)


@jit
def _rest_ahead(S: Any, L: Any) -> int:
    """What Newton steps on the rates find within REACH of ``here``, or MOVING; it is in ``there``."""
    n, k, found = S.chain.n, L.moves, False
    for i in range(n):
        L.there[i] = L.here[i]
    for _ in range(SEARCHES):
        put_slopes(S, L, L.there)
        for i in range(k):
            L.y[i] = -L.v[L.moving[i]]
            for j in range(k):
                L.work[i, j] = L.slope[i, j]
        if not lu_factor(L.work, k, L.pivots):
            return MOVING
        lu_solve(L.work, k, L.pivots, L.y)
        length, way = 0.0, 0.0
        for i in range(k):
            j = L.moving[i]
            length += L.y[i] * L.y[i]
            L.there[j] += L.y[i]
            way += (L.there[j] - L.here[j]) ** 2
        if not way < REACH * REACH:
            return MOVING
        if length < STILL * STILL:
            found = True
            break
    if not found:
        return MOVING
    put_slopes(S, L, L.there)
    if not dies_out(L, k):
        return MOVING
    return CORRECT if L.one_error[0] < (AT_GOAL * L.unit) ** 2 else ERRONEOUS


@jit
def _on_a_curve(S: Any, L: Any) -> int:
    """Whether ``here``, where all stands, is one of a continuum of rests that attracts: ERRONEOUS or MOVING.

    No eigenvalue of the slopes is on the right, those that are nil belong to the rests beside it.
    """
    for i in range(S.chain.n):
        L.there[i] = L.here[i]
    put_slopes(S, L, L.there)
    if L.one_error[0] < (AT_GOAL * L.unit) ** 2:
        return MOVING
    shift = NEUTRAL * max(1.0, largest_of(L.slope, L.moves))
    for i in range(L.moves):
        L.slope[i, i] -= shift
    return ERRONEOUS if dies_out(L, L.moves) else MOVING


@jit
def _points_back(S: Any, L: Any, way: float) -> bool:
    """Whether the field at ``there`` = ``here`` + way v/|v| points against v, which is in ``v``."""
    n = S.chain.n
    square = along = 0.0
    for i in range(n):
        square += L.v[i] * L.v[i]
    for i in range(n):
        L.there[i] = L.here[i] + way / sqrt(square) * L.v[i]
    rates_at(S, L, L.there, L.w)
    for i in range(n):
        along += L.w[i] * L.v[i]
    return along < -0.5 * sqrt(square) * L.one_speed[0]


@rare_jit
def _singularity_ahead(S: Any, L: Any) -> int:
    """Whether a singular configuration takes the motion in: behind it the field points back. Or MOVING."""
    rates_at(S, L, L.here, L.v)
    if L.one_regular[0] > NEARLY_FLAT or L.one_speed[0] < RESTING:
        return MOVING
    ratio = (LAST / FIRST) ** (1.0 / (FINER - 1))
    before, behind = 0.0, FIRST
    while not _points_back(S, L, behind):
        before, behind = behind, behind * ratio
        if behind > LAST:
            return MOVING
    for _ in range(FINER):
        middle = 0.5 * (before + behind)
        if _points_back(S, L, middle):
            behind = middle
        else:
            before = middle
    _points_back(S, L, behind)
    return SINGULAR if L.one_regular[0] < TRULY_FLAT else MOVING


@jit
def begin_alone(S: Any, L: Any, seat: int) -> None:
    """Make the run of a seat the one that is looked at alone: its joints that move, its place in ``here``."""
    k = 0
    for i in range(S.chain.n):
        free = L.free[i * WIDTH + seat]
        L.here[i] = L.q[i * WIDTH + seat]
        L.alone[i * WIDTH : (i + 1) * WIDTH] = free
        if free > 0.5:
            L.moving[k] = i
            k += 1
    L.moves = k


@rare_jit
def ending_ahead(S: Any, L: Any, speed: float, regular: float) -> int:
    """How the run at ``here`` ends that does not see the goal, or MOVING; the end is in ``there``."""
    if speed < SLOW * (SHARE + speed):
        ending = _rest_ahead(S, L)
        return _on_a_curve(S, L) if ending == MOVING and speed < RESTING else ending
    return _singularity_ahead(S, L) if regular < NEARLY_FLAT else MOVING
