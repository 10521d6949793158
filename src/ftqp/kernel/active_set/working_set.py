"""The working set of the active-set solver: its rows, their factor, and what they determine.

Position k holds the constraint ``code[k]`` at ``side[k]`` with multiplier ``lam[k]``; V[k] is its row times
H^(-1/2), G = V V' + compliance, L the Cholesky factor of G with inverse diagonal, t[k] = d - N x_free. The
QP, the codes
and the sides are those of ``ftqp.kernel.active_set.active_set``.
"""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.cholesky import factor

DEPENDENT = 1e-12
"""A row whose part outside the span of the working set is below this share (squared) counts as dependent."""

REFINE_FROM = 1e-12
"""Residual of an active row above which the solution is refined."""


@jit
def _back_substitute(L: Any, n: int, x: Any) -> None:
    """x <- L'^-1 x."""
    for i in range(n - 1, -1, -1):
        x[i] *= L[i, i]
        s = x[i]
        for j in range(i):
            x[j] -= L[i, j] * s


@jit
def minimise_free(K: Any) -> bool:
    """Factor H over the variables that are not fixed and put the unconstrained minimiser into x_free."""
    n = K.nx
    fixed = False
    if not K.dense:
        for i in range(n):
            if K.lb[i] >= K.ub[i]:
                K.root[i] = K.inverse[i] = 0.0
                K.x_free[i] = K.ub[i]
            else:
                h = K.H_diagonal[i]
                if h != K.root_of[i]:
                    if not h > 0.0:
                        return False
                    K.root_of[i], K.root_was[i] = h, 1.0 / sqrt(h)
                r = K.root_was[i]
                K.root[i], K.inverse[i] = r, r * r
                K.x_free[i] = -K.g[i] * r * r
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
    """Compliance of a row: task rows their own, inequality rows of C the elastic one, else none."""
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
def enter(K: Any, q: int, code: int, side: int, lam: float) -> bool:
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
def enter_task_rows(K: Any) -> bool:
    """All task rows into an empty working set, for a diagonal H; False when one depends on the others.

    G = A H^-1 A' + compliance is computed from A itself, so that nothing waits for V to reach memory.
    """
    n, m = K.nx, K.meq
    for k in range(m):
        K.code[k], K.side[k], K.lam[k] = k, 0, 0.0
        row = K.A[k]
        G = K.G[k]
        for j in range(k + 1):
            other = K.A[j]
            s = 0.0
            for i in range(n):
                s += row[i] * other[i] * K.inverse[i]
            G[j] = s
        G[k] += K.soft[k]
        t = K.b[k]
        for i in range(n):
            t -= row[i] * K.x_free[i]
        K.t[k] = t
    for k in range(m):
        row = K.A[k]
        V = K.V[k]
        for i in range(n):
            V[i] = row[i] * K.root[i]
    for k in range(m):
        if not _factor_row(K, k, K.soft[k]):
            return False
    return True


@jit
def leave(K: Any, q: int, k: int) -> int:
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
def solve_dual(K: Any, q: int, x: Any) -> None:
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
def primal(K: Any, q: int, lam: Any, x: Any) -> None:
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
def refine(K: Any, q: int) -> bool:
    """One step of refinement, S dlam = d - N x - compliance lam; False when nothing is left to do.

    A nearly hard row that cannot hold has a huge multiplier, whose rounding would otherwise show as a
    violated bound.
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
    solve_dual(K, q, r)
    for k in range(q):
        K.lam[k] += r[k]
    primal(K, q, r, K.scratch)
    for i in range(n):
        K.x[i] += K.scratch[i]
    return True
