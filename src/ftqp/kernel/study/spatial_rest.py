"""Where the motion of any arm after a lock ends: the goal or a rest that lies ahead, by Newton steps."""

from math import sqrt
from typing import Any, Final

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.endings import CORRECT, ERRONEOUS, NONE, SINGULAR
from ftqp.kernel.maths.cholesky import factor, solve_factored
from ftqp.kernel.maths.lu import lu_factor, lu_solve
from ftqp.kernel.study.planar_arm import SHARE
from ftqp.kernel.study.planar_goal import NEAR, REACH
from ftqp.kernel.study.planar_rest import MOVING, powers_die
from ftqp.kernel.study.planar_stiff import LONG_WAY, SLOW
from ftqp.kernel.study.resolved_rates import law_rates, weigh
from ftqp.kernel.study.task_values import task_values
from ftqp.kernel.study.tracing import put_joints

SEARCHES: Final = 12
"""Newton steps, at most."""
AT_GOAL: Final = 1e-9
"""|e| that counts as none [unit lengths]."""
DIFFERENCE: Final = 1e-6
"""Of slopes by central differences [rad or m]."""
FLAT: Final = 1e-10
"""Least pivot of B over the largest from which a rest is singular."""
NEARLY_FLAT: Final = 1e-5
"""The same from which a singularity ahead is looked for ..."""
TRULY_FLAT: Final = 1e-12
"""... and of one that takes a motion in."""
RESTING: Final = 1e-7
"""A motion this slow with gain 1 has come to rest, though there may be rests beside it [rad/s]."""
NEUTRAL: Final = 1e-6
"""An eigenvalue whose real part is this small beside the slopes belongs to a curve of rests."""
FIRST, LAST, FINER = 1e-9, 2.0 * REACH, 60
"""How far behind a singularity the field is looked at [rad], and by how many halvings it is found."""


@jit
def _goal_ahead(S: Any, L: Any) -> bool:
    """Whether Newton steps of the joints that move find the goal within REACH of ``q``, and it is stable.

    With one joint locked the eigenvalues of A I_S G are 1 and rho, so that rho is the trace less m - 1.
    """
    n, m = S.chain.n, S.study.m
    A = S.study.A
    for i in range(n):
        L.trial[i] = L.q[i]
    for _ in range(SEARCHES):
        put_joints(S, L.trial)
        size = task_values(S)
        if size < 1e-3 * AT_GOAL * L.unit:
            break
        for r in range(m):
            for c in range(r + 1):
                s = 0.0
                for i in range(n):
                    s += L.free[i] * A[r, i] * A[c, i]
                L.B[r, c] = s
            L.rhs[r] = S.study.e[r]
        if not factor(L.B, m):
            return False
        solve_factored(L.B, m, L.rhs)
        way = 0.0
        for i in range(n):
            s = 0.0
            for r in range(m):
                s += A[r, i] * L.rhs[r]
            L.trial[i] += L.free[i] * s
            way += (L.trial[i] - L.q[i]) ** 2
        if not way < REACH * REACH:
            return False
    if not (weigh(S, L, L.trial) and L.miss < AT_GOAL * L.unit):
        return False
    trace = 0.0
    for i in range(n):
        for r in range(m):
            L.column[r] = A[r, i]
        solve_factored(L.B, m, L.column)
        for r in range(m):
            trace += L.free[i] * L.P[i, r] * L.column[r]
    return trace > m - 1.0 and L.regular > FLAT


@jit
def put_slopes(S: Any, L: Any, q: Any) -> None:
    """d(I_S G e)/dq at q into ``slope``, by central differences; zero for joints that do not move."""
    n = S.chain.n
    for i in range(n):
        L.here[i] = q[i]
    for l in range(n):
        if L.free[l] < 0.5:
            for i in range(n):
                L.slope[i, l] = 0.0
            continue
        L.here[l] = q[l] + DIFFERENCE
        law_rates(S, L, L.here, L.there)
        L.here[l] = q[l] - DIFFERENCE
        law_rates(S, L, L.here, L.v)
        L.here[l] = q[l]
        for i in range(n):
            L.slope[i, l] = (L.there[i] - L.v[i]) / (2.0 * DIFFERENCE)


@jit
def _rest_ahead(S: Any, L: Any) -> int:
    """What Newton steps on the rates find within REACH of ``q``, or MOVING; it is in ``trial``."""
    n = S.chain.n
    for i in range(n):
        L.trial[i] = L.q[i]
    found = False
    for _ in range(SEARCHES):
        put_slopes(S, L, L.trial)
        law_rates(S, L, L.trial, L.v)
        for i in range(n):
            L.y[i] = -L.v[i]
            for j in range(n):
                L.work[i, j] = L.slope[i, j]
            if L.free[i] < 0.5:
                L.work[i, i] = 1.0
        if not lu_factor(L.work, n, L.pivots):
            return MOVING
        lu_solve(L.work, n, L.pivots, L.y)
        length, way = 0.0, 0.0
        for i in range(n):
            length += L.y[i] * L.y[i]
            L.trial[i] += L.y[i]
            way += (L.trial[i] - L.q[i]) ** 2
        if not way < REACH * REACH:
            return MOVING
        if length < 1e-18:
            found = True
            break
    if not found:
        return MOVING
    put_slopes(S, L, L.trial)
    law_rates(S, L, L.trial, L.v)
    size, regular, scale = L.miss, L.regular, 0.0
    for i in range(n):
        for j in range(n):
            scale = max(scale, abs(L.slope[i, j]))
    for i in range(n):
        if L.free[i] < 0.5:
            L.slope[i, i] = -scale
    if not (scale > 0.0 and powers_die(L, n, scale)) or size < 1e-6 * L.unit:
        return MOVING
    return ERRONEOUS if regular > FLAT else SINGULAR


@jit
def _on_a_curve(S: Any, L: Any) -> int:
    """Whether ``q``, where all stands, is one of a continuum of rests that attracts: ERRONEOUS or MOVING.

    No eigenvalue of the slopes is on the right, those that are nil belong to the rests beside it.
    """
    n = S.chain.n
    put_slopes(S, L, L.q)
    law_rates(S, L, L.q, L.v)
    if L.miss < 1e-6 * L.unit or not L.regular > FLAT:
        return MOVING
    scale = 0.0
    for i in range(n):
        L.trial[i] = L.q[i]
        for j in range(n):
            scale = max(scale, abs(L.slope[i, j]))
    for i in range(n):
        L.slope[i, i] -= NEUTRAL * scale
        if L.free[i] < 0.5:
            L.slope[i, i] = -scale
    return ERRONEOUS if scale > 0.0 and powers_die(L, n, scale) else MOVING


@jit
def _points_back(S: Any, L: Any, way: float) -> bool:
    """Whether the field at ``trial`` = ``q`` + way v/|v| points against v, which is in ``v``."""
    n = S.chain.n
    square = along = 0.0
    for i in range(n):
        square += L.v[i] * L.v[i]
    for i in range(n):
        L.trial[i] = L.q[i] + way / sqrt(square) * L.v[i]
    law_rates(S, L, L.trial, L.there)
    for i in range(n):
        along += L.there[i] * L.v[i]
    return along < -0.5 * sqrt(square) * L.speed


@jit
def _singularity_ahead(S: Any, L: Any) -> int:
    """Whether a singular configuration takes the motion in: behind it the field points back. Or MOVING.

    Source: docs/theory/after-a-failure.md, "Arms in space".
    """
    law_rates(S, L, L.q, L.v)
    if L.regular > NEARLY_FLAT or L.speed < RESTING:
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
    return SINGULAR if L.regular < TRULY_FLAT else MOVING


@jit
def verdict(S: Any, L: Any, size: float, speed: float, way: float) -> int:
    """How a run ends that is at ``q``, or MOVING."""
    if size < NEAR * L.unit and _goal_ahead(S, L):
        return CORRECT
    if speed < SLOW * (SHARE + speed):
        ending = _rest_ahead(S, L)
        return _on_a_curve(S, L) if ending == MOVING and speed < RESTING else ending
    if _singularity_ahead(S, L) == SINGULAR:
        return SINGULAR
    return NONE if way > LONG_WAY else MOVING
