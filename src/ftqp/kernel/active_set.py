"""The default solver: a warm-started dual active set with compliant equality rows.

    min 1/2 x'Hx + g'x + sum_k s_k^2 / (2 soft_k)   s.t.  A x + s = b,  lb <= x <= ub,  l <= C x <= u

The dual of a strictly convex QP has sign constraints only, so any working set with multipliers of the right sign is a legal
start: the last tick's is the warm start. On a working set with rows N (A, then bounds and rows of C) and right sides d,
    S lam = d - N x_free,  S = N H^-1 N' + diag(compliance),  x = x_free + H^-1 N' lam
where x_free = -H^-1 g. A multiplier of the wrong sign stops the step where it vanishes and leaves; else the most violated
bound enters; none means solved. soft = 0 gives hard rows and soft > 0 the slack, at no extra variable. Fixed variables
(lb = ub) are eliminated. H > 0.

Constraint codes: 0..meq-1 rows of A; meq.. the box; meq+nx.. rows of C. ``side``: +1 at a lower end (lam >= 0), -1 at an
upper end (lam <= 0), 0 an equality. ``lam`` is here -y of the Lagrangian f + y'(Ax-b) + z'Cx + z_box'x.
Source: dual view as in Arnstroem, Bemporad, Axehill, IEEE TAC 2022 (DAQP).
"""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.cholesky import factor
from ftqp.kernel.codes import FAILED, INFEASIBLE, MAX_ITERATIONS, SOLVED
from ftqp.kernel.jit import jit

DEPENDENT = 1e-12
"""A row whose part outside the span of the working set is below this share (squared) counts as dependent."""

REFINE_FROM = 1e-12
"""Residual of an active row above which the solution is refined ..."""
REFINEMENTS = 3
"""... and how often at most."""


@jit
def _minimise_free(K: Any) -> bool:
    """Factor H over the variables that are not fixed and put the unconstrained minimiser into x_free."""
    n = K.nx
    fixed = False
    if not K.dense:
        for i in range(n):
            if K.lb[i] >= K.ub[i]:
                K.root[i] = 0.0
                K.x_free[i] = K.ub[i]
            else:
                h = K.H_diagonal[i]
                if not h > 0.0:
                    return False
                K.root[i] = 1.0 / sqrt(h)
                K.x_free[i] = -K.g[i] / h
        return True
    L = K.L_H
    for i in range(n):
        K.root[i] = 1.0
        if K.lb[i] >= K.ub[i]:
            K.root[i] = 0.0
            fixed = True
    for i in range(n):
        if K.root[i] == 0.0:
            for j in range(i):
                L[i, j] = 0.0
            L[i, i] = 1.0
            K.x_free[i] = 0.0
            continue
        s = -K.g[i]
        for j in range(i + 1):
            L[i, j] = K.H[i, j] * K.root[j]
        if fixed:
            for j in range(n):
                if K.root[j] == 0.0:
                    s -= K.H[i, j] * K.ub[j]
        K.x_free[i] = s
    if not factor(L, n):
        return False
    x = K.x_free
    for i in range(n):
        s = x[i]
        for j in range(i):
            s -= L[i, j] * x[j]
        x[i] = s * L[i, i]
    _back_substitute(L, n, x)
    for i in range(n):
        if K.root[i] == 0.0:
            x[i] = K.ub[i]
    return True


@jit
def _back_substitute(L: Any, n: int, x: Any) -> None:
    """x <- L'^-1 x."""
    for i in range(n - 1, -1, -1):
        x[i] *= L[i, i]
        s = x[i]
        for j in range(i):
            x[j] -= L[i, j] * s


@jit
def _whiten(K: Any, code: int, k: int) -> None:
    """V[k] = H^(-1/2) times the row ``code``; entries of fixed variables are zero."""
    n, m = K.nx, K.meq
    V = K.V[k]
    if code < m:
        row = K.A[code]
        for i in range(n):
            V[i] = row[i]
    elif code < m + n:
        for i in range(n):
            V[i] = 0.0
        V[code - m] = 1.0
    else:
        row = K.C[code - m - n]
        for i in range(n):
            V[i] = row[i]
    if not K.dense:
        for i in range(n):
            V[i] *= K.root[i]
        return
    L = K.L_H
    for i in range(n):
        if K.root[i] == 0.0:
            V[i] = 0.0
            continue
        s = V[i]
        Li = L[i]
        for j in range(i):
            s -= Li[j] * V[j]
        V[i] = s * Li[i]


@jit
def _gram_row(K: Any, k: int, soft: float) -> None:
    """Row k of V V' + diag(compliance)."""
    n = K.nx
    V = K.V[k]
    for j in range(k + 1):
        W = K.V[j]
        s = 0.0
        for i in range(n):
            s += V[i] * W[i]
        K.G[k, j] = s
    K.G[k, k] += soft


@jit
def _factor_row(K: Any, k: int, soft: float) -> bool:
    """Row k of the Cholesky factor of G; False when the row depends on those before it."""
    L = K.L[k]
    G = K.G[k]
    pivot = G[k]
    for j in range(k):
        s = G[j]
        Lj = K.L[j]
        for i in range(j):
            s -= L[i] * Lj[i]
        s *= Lj[j]
        L[j] = s
        pivot -= s * s
    if pivot <= DEPENDENT * G[k]:
        if soft <= 0.0:
            return False
        pivot = max(pivot, soft)
    if not pivot > 0.0:
        return False
    L[k] = 1.0 / sqrt(pivot)
    return True


@jit
def _right_side(K: Any, code: int, side: int) -> float:
    """d - N x_free for one row."""
    n, m = K.nx, K.meq
    if code < m:
        s = K.b[code]
        row = K.A[code]
        for i in range(n):
            s -= row[i] * K.x_free[i]
        return s
    if code < m + n:
        i = code - m
        return (K.lb[i] if side > 0 else K.ub[i]) - K.x_free[i]
    j = code - m - n
    s = K.l[j] if side > 0 else K.u[j]
    row = K.C[j]
    for i in range(n):
        s -= row[i] * K.x_free[i]
    return s


@jit
def _softness(K: Any, code: int, side: int) -> float:
    """Compliance of a row: task rows their own, inequality rows of C the elastic one, everything else none."""
    if code < K.meq:
        soft: float = K.soft[code]
        return soft
    if code >= K.meq + K.nx and side != 0:
        elastic: float = K.soft_rows
        return elastic
    return 0.0


@jit
def _is_crowded(K: Any, q: int) -> bool:
    """Whether q rows hold a hard one for every variable, so that the next hard one must depend on them."""
    free = hard = 0
    for i in range(K.nx):
        if K.root[i] != 0.0:
            free += 1
    if q < free:
        return False
    for k in range(q):
        if _softness(K, K.code[k], K.side[k]) <= 0.0:
            hard += 1
    return hard >= free


@jit
def _enter(K: Any, q: int, code: int, side: int, lam: float) -> bool:
    """Append a row to the working set of q rows; False when it depends on them."""
    soft = _softness(K, code, side)
    K.code[q], K.side[q], K.lam[q] = code, side, lam
    _whiten(K, code, q)
    _gram_row(K, q, soft)
    if not _factor_row(K, q, soft) or (soft <= 0.0 and _is_crowded(K, q)):
        return False
    K.t[q] = _right_side(K, code, side)
    if code >= K.meq:
        K.active[code - K.meq] = 1
    return True


@jit
def _leave(K: Any, q: int, k: int) -> int:
    """Take row k out of the working set of q rows; the new number of rows."""
    n = K.nx
    K.active[K.code[k] - K.meq] = 0
    for i in range(k, q - 1):
        K.code[i], K.side[i], K.lam[i], K.t[i] = K.code[i + 1], K.side[i + 1], K.lam[i + 1], K.t[i + 1]
        for j in range(n):
            K.V[i, j] = K.V[i + 1, j]
        for j in range(k):
            K.G[i, j] = K.G[i + 1, j]
        for j in range(k, i + 1):
            K.G[i, j] = K.G[i + 1, j + 1]
    for i in range(k, q - 1):
        _factor_row(K, i, _softness(K, K.code[i], K.side[i]))
    return q - 1


@jit
def _solve_dual(K: Any, q: int, x: Any) -> None:
    """x <- S^-1 x on the working set."""
    for i in range(q):
        s = x[i]
        L = K.L[i]
        for j in range(i):
            s -= L[j] * x[j]
        x[i] = s * L[i]
    for i in range(q - 1, -1, -1):
        L = K.L[i]
        x[i] *= L[i]
        s = x[i]
        for j in range(i):
            x[j] -= L[j] * s


@jit
def _primal(K: Any, q: int, lam: Any, x: Any) -> None:
    """x = H^(-1/2)' V' lam, the step away from x_free."""
    n = K.nx
    for i in range(n):
        x[i] = 0.0
    for k in range(q):
        y = lam[k]
        V = K.V[k]
        for i in range(n):
            x[i] += V[i] * y
    if K.dense:
        _back_substitute(K.L_H, n, x)
        for i in range(n):
            if K.root[i] == 0.0:
                x[i] = 0.0
    else:
        for i in range(n):
            x[i] *= K.root[i]


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
    """The first working set: task rows, equalities among the rows of C, then the last working set. (rows, equalities)"""
    m, n = K.meq, K.nx
    for k in range(n + K.nc):
        K.active[k] = 0
    q = 0
    for k in range(m):
        if _enter(K, q, k, 0, 0.0):
            q += 1
    for j in range(K.nc):
        if K.l[j] == K.u[j] and _enter(K, q, m + n + j, 0, 0.0):
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
        if _enter(K, q, code, side, K.warm_lam[k]):
            q += 1
    return q, equalities


@jit
def _trade_places(K: Any, q: int, equalities: int, side: int, lam: float) -> tuple[int, float, bool]:
    """The entering row q depends on the working set: move along the null direction until a multiplier vanishes.

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
    return _leave(K, q, k), lam + best * side, True


@jit
def _refine(K: Any, q: int) -> bool:
    """One step of iterative refinement on the working set: S dlam = d - N x - compliance lam. False when nothing is left.

    A nearly hard row that cannot hold has a huge multiplier, whose rounding would otherwise show as a violated bound.
    """
    n, m = K.nx, K.meq
    r = K.lam_new
    worst = 0.0
    for k in range(q):
        code, side = K.code[k], K.side[k]
        s = -_softness(K, code, side) * K.lam[k]
        if code < m:
            s += K.b[code]
            row = K.A[code]
            for i in range(n):
                s -= row[i] * K.x[i]
        elif code < m + n:
            i = code - m
            s += (K.lb[i] if side > 0 else K.ub[i]) - K.x[i]
        else:
            j = code - m - n
            s += K.l[j] if side > 0 else K.u[j]
            row = K.C[j]
            for i in range(n):
                s -= row[i] * K.x[i]
        r[k] = s
        worst = max(worst, abs(s))
    if not worst > REFINE_FROM:
        return False
    _solve_dual(K, q, r)
    for k in range(q):
        K.lam[k] += r[k]
    _primal(K, q, r, K.scratch)
    for i in range(n):
        K.x[i] += K.scratch[i]
    return True


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
    """Solve the QP in the record from its last working set. SOLVED, MAX_ITERATIONS, INFEASIBLE or FAILED (H not > 0)."""
    warm = K.warm
    K.warm = 0
    K.iterations = 0
    for i in range(K.nx):
        if not K.lb[i] <= K.ub[i]:
            return INFEASIBLE
    for j in range(K.nc):
        if not K.l[j] <= K.u[j]:
            return INFEASIBLE
    if not _minimise_free(K):
        return FAILED
    q, equalities = _start(K, warm)
    working = len(K.lam)
    for it in range(K.max_iterations):
        for i in range(q):
            K.lam_new[i] = K.t[i]
        _solve_dual(K, q, K.lam_new)
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
            q = _leave(K, q, k)
            continue
        for i in range(q):
            K.lam[i] = K.lam_new[i]
        _primal(K, q, K.lam, K.x)
        for i in range(K.nx):
            K.x[i] += K.x_free[i]
        for _ in range(REFINEMENTS):
            if not _refine(K, q):
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
        while not _enter(K, q, code, side, lam):
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
