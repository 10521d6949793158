"""Runs of any arm after one joint has locked and nobody was told: the same verdicts as of planar arms."""

from collections.abc import Callable
from math import sqrt
from typing import Any, Final

import numpy as np

from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.layout.endings import CORRECT, ERRONEOUS, NONE, SINGULAR, UNRESOLVED
from ftqp.kernel.layout.law_room import law_dtype
from ftqp.kernel.layout.study_room import study_dtype
from ftqp.kernel.maths.cholesky import factor, solve_factored
from ftqp.kernel.maths.lu import lu_factor, lu_solve
from ftqp.kernel.study.planar_arm import SHARE
from ftqp.kernel.study.planar_goal import NEAR, REACH
from ftqp.kernel.study.planar_rest import MOVING, powers_die
from ftqp.kernel.study.planar_stiff import LONG_WAY, SLOW
from ftqp.kernel.study.resolved_rates import law_rates, weigh
from ftqp.kernel.study.task_values import task_values
from ftqp.kernel.study.tracing import put_joints

STEPS: Final = 1000
"""Trial steps of a run, at most."""
SEARCHES: Final = 12
"""Newton steps, at most."""
AT_GOAL: Final = 1e-9
"""|e| that counts as none [unit lengths]."""
DIFFERENCE: Final = 1e-6
"""Of slopes by central differences [rad or m]."""
FLAT: Final = 1e-10
"""Least pivot of B over the largest from which a rest is singular."""
FLOAT, WHOLE = np.dtype(np.float64), np.dtype(np.int64)


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
def _slopes(S: Any, L: Any, q: Any) -> None:
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
        _slopes(S, L, L.trial)
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
    _slopes(S, L, L.trial)
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
def _scaled(S: Any, L: Any, q: Any, out: Any) -> None:
    """dq/ds = v / (c + |v|) into ``out``."""
    law_rates(S, L, q, out)
    scale = 1.0 / (SHARE + L.speed)
    for i in range(S.chain.n):
        out[i] *= scale


@jit
def _verdict(S: Any, L: Any, size: float, speed: float, way: float) -> int:
    """How a run ends that is at ``q``, or MOVING."""
    if size < NEAR * L.unit and _goal_ahead(S, L):
        return CORRECT
    if speed < SLOW * (SHARE + speed):
        return _rest_ahead(S, L)
    return NONE if way > LONG_WAY else MOVING


@jit
def one_run(S: Any, L: Any) -> int:
    """How the run from ``q`` ends by steps of orders 3 and 2; its end is in ``trial``, else in ``q``.

    Source: Bogacki and Shampine 1989, the 3(2) pair.
    """
    n, h, way = S.chain.n, 0.05, 0.0
    _scaled(S, L, L.q, L.k1)
    size, speed = L.miss, L.speed
    for step in range(STEPS):
        if step % 4 == 0:
            ending = _verdict(S, L, size, speed, way)
            if ending != MOVING:
                return ending
        for i in range(n):
            L.next[i] = L.q[i] + 0.5 * h * L.k1[i]
        _scaled(S, L, L.next, L.k2)
        for i in range(n):
            L.next[i] = L.q[i] + 0.75 * h * L.k2[i]
        _scaled(S, L, L.next, L.k3)
        for i in range(n):
            L.next[i] = L.q[i] + h * (2.0 * L.k1[i] + 3.0 * L.k2[i] + 4.0 * L.k3[i]) / 9.0
        _scaled(S, L, L.next, L.k4)
        wrong, moved = 0.0, 0.0
        for i in range(n):
            miss = -5.0 / 72.0 * L.k1[i] + L.k2[i] / 12.0 + L.k3[i] / 9.0 - 0.125 * L.k4[i]
            wrong += miss * miss
            moved += (L.next[i] - L.q[i]) ** 2
        wrong = h * sqrt(wrong) / L.tolerance
        if wrong <= 1.0:
            size, speed, way = L.miss, L.speed, way + sqrt(moved)
            for i in range(n):
                L.q[i], L.k1[i] = L.next[i], L.k4[i]
        h = min(1.0, h * min(5.0, max(0.2, 0.9 / (wrong + 1e-9) ** (1.0 / 3.0))))
    for i in range(n):
        L.trial[i] = L.q[i]
    return UNRESOLVED


def study_runs(capacity: int) -> Callable[..., int]:
    """Runs of an arm after failures."""
    study, law = study_dtype(capacity), law_dtype(capacity)

    def study_runs(
        address: int, law_at: int, count: int, q_at: int, locked_at: int, endings_at: int, sizes_at: int
    ) -> int:
        """Rows q (count, n) from start to end, locked joints (count,), endings (count,), |e| (count,)."""
        S, L = carray(pointer(address), 1, study)[0], carray(pointer(law_at), 1, law)[0]
        n = S.chain.n
        q, locked = carray(pointer(q_at), (count, n), FLOAT), carray(pointer(locked_at), (count,), WHOLE)
        endings = carray(pointer(endings_at), (count,), WHOLE)
        sizes = carray(pointer(sizes_at), (count,), FLOAT)
        for k in range(count):
            for i in range(n):
                L.q[i] = q[k, i]
                L.free[i] = 0.0 if i == locked[k] else 1.0
            endings[k] = one_run(S, L)
            put_joints(S, L.q if endings[k] == NONE else L.trial)
            sizes[k] = task_values(S)
            for i in range(n):
                q[k, i] = S.state.q[i]
        return 0

    return study_runs
