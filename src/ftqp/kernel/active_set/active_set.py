"""The default solver: a warm-started dual active set with compliant equality rows.

    min 1/2 x'Hx + g'x + sum_k s_k^2 / (2 soft_k)   s.t.  A x + s = b,  lb <= x <= ub,  l <= C x <= u

The dual of a strictly convex QP has sign constraints only, so any working set with multipliers of the right
sign is a legal
start: the last tick's is the warm start. On a working set with rows N (A, then bounds and rows of C) and
right sides d,
    S lam = d - N x_free,  S = N H^-1 N' + diag(compliance),  x = x_free + H^-1 N' lam
where x_free = -H^-1 g. A multiplier of the wrong sign stops the step where it vanishes and leaves; else the
most violated
bound enters; none means solved. soft = 0 gives hard rows and soft > 0 the slack, at no extra variable. Fixed
variables
(lb = ub) are eliminated. H > 0.

Constraint codes: 0..meq-1 rows of A; meq.. the box; meq+nx.. rows of C. ``side``: +1 at a lower end (lam >=
0), -1 at an
upper end (lam <= 0), 0 an equality. ``lam`` is here -y of the Lagrangian f + y'(Ax-b) + z'Cx + z_box'x.
Source: dual view as in Arnstroem, Bemporad, Axehill, IEEE TAC 2022 (DAQP).
"""

from math import inf
from typing import Any

from ftqp.kernel.active_set.working_set import (
    enter,
    enter_task_rows,
    leave,
    minimise_free,
    primal,
    refine,
    solve_dual,
)
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import FAILED, INFEASIBLE, MAX_ITERATIONS, SOLVED

REFINEMENTS = 3
"""How often a solution is refined at most."""


@jit
def _worst_violation(K: Any) -> tuple[int, int, float]:
    """Code and side of the bound or row that x violates most, or -1, and by how much."""
    n, m = K.nx, K.meq
    worst, code, side = K.tolerance, -1, 0
    for i in range(n):
        if K.active[i] == 0 and K.root[i] != 0.0:
            x = K.x[i]
            if K.lb[i] - x > worst:
                worst, code, side = K.lb[i] - x, m + i, 1
            if x - K.ub[i] > worst:
                worst, code, side = x - K.ub[i], m + i, -1
    for j in range(K.nc):
        if K.active[n + j] == 0 and (K.l[j] > -inf or K.u[j] < inf):
            s = 0.0
            row = K.C[j]
            for i in range(n):
                s += row[i] * K.x[i]
            if K.l[j] - s > worst:
                worst, code, side = K.l[j] - s, m + n + j, 1
            if s - K.u[j] > worst:
                worst, code, side = s - K.u[j], m + n + j, -1
    return code, side, worst


@jit
def _is_rounding(K: Any, q: int, violation: float) -> bool:
    """Whether errors of ``tolerance`` in the q rows that a row depends on explain its violation.

    The row is sum r_i N_i, r left in lam_new by ``_trade_places``: many limits meet in one point.
    """
    weight = 1.0
    for i in range(q):
        weight += abs(K.lam_new[i])
    return violation <= K.tolerance * weight


@jit
def _start(K: Any, warm: int) -> tuple[int, int]:
    """The first working set: task rows, equality rows of C, then the last one. (rows, equalities)"""
    m, n = K.meq, K.nx
    for k in range(n + K.nc):
        K.active[k] = 0
    q = 0
    if not K.dense and m <= n and enter_task_rows(K):
        q = m
    else:
        for k in range(m):
            if enter(K, q, k, 0, 0.0):
                q += 1
    for j in range(K.nc):
        if K.l[j] == K.u[j] and enter(K, q, m + n + j, 0, 0.0):
            q += 1
    equalities = q
    for k in range(warm):
        code, side = K.warm_code[k], K.warm_side[k]
        if code < m + n:
            i = code - m
            if K.root[i] == 0.0 or (K.lb[i] if side > 0 else K.ub[i]) in (inf, -inf):
                continue
        else:
            j = code - m - n
            if j >= K.nc or K.l[j] == K.u[j] or (K.l[j] if side > 0 else K.u[j]) in (inf, -inf):
                continue
        if enter(K, q, code, side, K.warm_lam[k]):
            q += 1
    return q, equalities


@jit
def _trade_places(K: Any, q: int, equalities: int, side: int, lam: float) -> tuple[int, float, bool]:
    """The entering row q depends on the others: move along the null direction until a multiplier vanishes.

    Returns (rows left, multiplier of the entering row, False when none vanishes: the QP is infeasible).
    """
    r = K.lam_new
    for i in range(q):
        r[i] = K.L[q, i] * side
    for i in range(q - 1, -1, -1):
        r[i] *= K.L[i, i]
        s = r[i]
        for j in range(i):
            r[j] -= K.L[i, j] * s
    best, k = inf, -1
    for i in range(equalities, q):
        slope = r[i] * K.side[i]
        if slope > 1e-13 and abs(K.lam[i]) < best * slope:
            best, k = abs(K.lam[i]) / slope, i
    if k < 0:
        return q, lam, False
    for i in range(q):
        K.lam[i] -= best * r[i]
    return leave(K, q, k), lam + best * side, True


@jit
def _publish(K: Any, q: int, equalities: int) -> None:
    """Multipliers by the convention of ftqp.QP, and the working set for the next start."""
    n, m = K.nx, K.meq
    for k in range(m):
        K.y[k] = 0.0
    for i in range(n):
        K.z_box[i] = 0.0
    for j in range(K.nc):
        K.z[j] = 0.0
    for k in range(q):
        code = K.code[k]
        if code < m:
            K.y[code] = -K.lam[k]
        elif code < m + n:
            K.z_box[code - m] = -K.lam[k]
        else:
            K.z[code - m - n] = -K.lam[k]
    K.warm = q - equalities
    for k in range(equalities, q):
        w = k - equalities
        K.warm_code[w], K.warm_side[w], K.warm_lam[w] = K.code[k], K.side[k], K.lam[k]
    for i in range(n):  # stationarity gives the multipliers of fixed variables
        if K.root[i] == 0.0:
            s = K.g[i]
            if K.dense:
                for j in range(n):
                    s += K.H[i, j] * K.x[j]
            else:
                s += K.H_diagonal[i] * K.x[i]
            for k in range(m):
                s += K.A[k, i] * K.y[k]
            for j in range(K.nc):
                s += K.C[j, i] * K.z[j]
            K.z_box[i] = -s


@jit
def _task_rows_hold(K: Any) -> bool:
    """Whether the hard rows left out as dependent hold all the same."""
    n = K.nx
    for k in range(K.meq):
        if K.soft[k] <= 0.0:
            s = K.b[k]
            size = abs(K.b[k])
            for i in range(n):
                s -= K.A[k, i] * K.x[i]
                size = max(size, abs(K.A[k, i] * K.x[i]))
            if not abs(s) <= 1e-8 * (1.0 + size):
                return False
    return True


@jit
def active_set(K: Any) -> int:
    """Solve the QP from its last working set: SOLVED, MAX_ITERATIONS, INFEASIBLE or FAILED (H not > 0)."""
    warm = K.warm
    K.warm = 0
    K.iterations = 0
    for i in range(K.nx):
        if not K.lb[i] <= K.ub[i]:
            return INFEASIBLE
    for j in range(K.nc):
        if not K.l[j] <= K.u[j]:
            return INFEASIBLE
    if not minimise_free(K):
        return FAILED
    q, equalities = _start(K, warm)
    working = len(K.lam)
    for it in range(K.max_iterations):
        for i in range(q):
            K.lam_new[i] = K.t[i]
        solve_dual(K, q, K.lam_new)
        step, k = 1.0, -1
        for i in range(equalities, q):
            if K.lam_new[i] * K.side[i] < 0.0:
                d = K.lam[i] - K.lam_new[i]
                f = K.lam[i] / d if d != 0.0 else 0.0
                if f < step:
                    step, k = f, i
        if k >= 0:
            for i in range(q):
                K.lam[i] += step * (K.lam_new[i] - K.lam[i])
            q = leave(K, q, k)
            continue
        for i in range(q):
            K.lam[i] = K.lam_new[i]
        primal(K, q, K.lam, K.x)
        for i in range(K.nx):
            K.x[i] += K.x_free[i]
        for _ in range(REFINEMENTS):
            if not refine(K, q):
                break
        code, side, violation = _worst_violation(K)
        if code < 0:
            K.iterations = it + 1
            if not _task_rows_hold(K):
                return INFEASIBLE
            _publish(K, q, equalities)
            return SOLVED
        lam = 0.0
        if q >= working:
            return FAILED
        possible = True
        while not enter(K, q, code, side, lam):
            q, lam, possible = _trade_places(K, q, equalities, side, lam)
            if not possible:
                break
        if possible:
            q += 1
        elif _is_rounding(K, q, violation):
            K.active[code - K.meq] = 1  # met as well as rounding lets it: no longer looked at
        else:
            K.iterations = it + 1
            return INFEASIBLE
    K.iterations = K.max_iterations
    return MAX_ITERATIONS
