"""The working set of the active-set solver: its rows, their factor, and what they determine.

Position k holds the constraint ``code[k]`` at ``side[k]`` with multiplier ``lam[k]``; V[k] is its row times
H^(-1/2), G = V V' + compliance, L the Cholesky factor of G with inverse diagonal, t[k] = d - N x_free. The
QP, the codes and the sides are those of ``ftqp.kernel.active_set.active_set``.
"""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit, long_jit
from ftqp.kernel.maths.linear_systems import factor

DEPENDENT = 1e-12
"""A row whose part outside the span of the working set is below this share (squared) counts as dependent. The
pivot is a difference of which rounding leaves some 1e-16, so that four digits are left at the bound."""

SOFTER = 1e4
"""Where all rows of C give way, the last of them are so many times softer."""
REFINE_FROM = 1e-12
"""Residual of an active row, in its own unit, above which the solution is refined: two digits below 1e-10,
the tolerance of ``ftqp.control.planner.assembly``, so that rows that were solved well cost nothing."""


@jit
def _substitute(L: Any, n: int, x: Any) -> None:
    """x <- L^-1 x."""
    for i in range(n):
        s = x[i]
        row = L[i]
        for j in range(i):
            s -= row[j] * x[j]
        x[i] = s * row[i]


@jit
def _back_substitute(L: Any, n: int, x: Any) -> None:
    """x <- L'^-1 x."""
    for i in range(n - 1, -1, -1):
        x[i] *= L[i, i]
        s = x[i]
        for j in range(i):
            x[j] -= L[i, j] * s


@jit
def minimise_free(Q: Any) -> bool:
    """Factor H over the variables that are not fixed and put the unconstrained minimiser into x_free."""
    n = Q.nx
    fixed = False
    if not Q.dense:
        for i in range(n):
            if Q.lb[i] >= Q.ub[i]:
                Q.root[i] = Q.inverse[i] = 0.0
                Q.x_free[i] = Q.ub[i]
            else:
                h = Q.H_diagonal[i]
                if h != Q.root_of[i]:
                    if not h > 0.0:
                        return False
                    Q.root_of[i], Q.root_was[i] = h, 1.0 / sqrt(h)
                r = Q.root_was[i]
                Q.root[i], Q.inverse[i] = r, r * r
                Q.x_free[i] = -Q.g[i] * r * r
        return True
    L = Q.L_H
    for i in range(n):
        Q.root[i] = 1.0
        if Q.lb[i] >= Q.ub[i]:
            Q.root[i] = 0.0
            fixed = True
    for i in range(n):
        if Q.root[i] == 0.0:
            for j in range(i):
                L[i, j] = 0.0
            L[i, i] = 1.0
            Q.x_free[i] = 0.0
            continue
        s = -Q.g[i]
        for j in range(i + 1):
            L[i, j] = Q.H[i, j] * Q.root[j]
        if fixed:
            for j in range(n):
                if Q.root[j] == 0.0:
                    s -= Q.H[i, j] * Q.ub[j]
        Q.x_free[i] = s
    if not factor(L, n):
        return False
    x = Q.x_free
    _substitute(L, n, x)
    _back_substitute(L, n, x)
    for i in range(n):
        if Q.root[i] == 0.0:
            x[i] = Q.ub[i]
    return True


@long_jit
def _whiten(Q: Any, code: int, k: int) -> None:
    """V[k] = H^(-1/2) times the row ``code``; entries of fixed variables are zero."""
    n, m = Q.nx, Q.meq
    V = Q.V[k]
    if code < m:
        row = Q.A[code]
        for i in range(n):
            V[i] = row[i]
    elif code < m + n:
        for i in range(n):
            V[i] = 0.0
        V[code - m] = 1.0
    else:
        row = Q.C[code - m - n]
        for i in range(n):
            V[i] = row[i]
    if not Q.dense:
        for i in range(n):
            V[i] *= Q.root[i]
        return
    L = Q.L_H
    for i in range(n):
        if Q.root[i] == 0.0:
            V[i] = 0.0
            continue
        s = V[i]
        Li = L[i]
        for j in range(i):
            s -= Li[j] * V[j]
        V[i] = s * Li[i]


@jit
def _gram_row(Q: Any, k: int, soft: float) -> None:
    """Row k of V V' + diag(compliance)."""
    n = Q.nx
    V = Q.V[k]
    for j in range(k + 1):
        W = Q.V[j]
        s = 0.0
        for i in range(n):
            s += V[i] * W[i]
        Q.G[k, j] = s
    Q.G[k, k] += soft


@jit
def _factor_row(Q: Any, k: int, soft: float) -> bool:
    """Row k of the Cholesky factor of G; False when the row depends on those before it."""
    L = Q.L[k]
    G = Q.G[k]
    pivot = G[k]
    for j in range(k):
        s = G[j]
        Lj = Q.L[j]
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
def _gap(Q: Any, code: int, side: int, x: Any, s: float) -> float:
    """s + d - N x for one row."""
    n, m = Q.nx, Q.meq
    if code >= m and code < m + n:
        i = code - m
        return s + ((Q.lb[i] if side > 0 else Q.ub[i]) - x[i])
    if code < m:
        s += Q.b[code]
        row = Q.A[code]
    else:
        j = code - m - n
        s += Q.l[j] if side > 0 else Q.u[j]
        row = Q.C[j]
    for i in range(n):
        s -= row[i] * x[i]
    return s


@jit
def _softness(Q: Any, code: int, side: int) -> float:
    """Compliance of a row: task rows their own, rows of C that may give way the elastic one, else none."""
    if code < Q.meq:
        soft: float = Q.soft[code]
        return soft
    row = code - Q.meq - Q.nx
    if row >= 0 and (side != 0 or row >= Q.rigid):
        elastic: float = Q.soft_rows
        if Q.soft_last > 0.0 and row >= Q.yields_from:
            return max(Q.soft_last, SOFTER * elastic)
        return elastic
    return 0.0


@jit
def _is_crowded(Q: Any, q: int) -> bool:
    """Whether q rows hold a hard one for every variable, so that the next hard one must depend on them."""
    free = hard = 0
    for i in range(Q.nx):
        if Q.root[i] != 0.0:
            free += 1
    if q < free:
        return False
    for k in range(q):
        if _softness(Q, Q.code[k], Q.side[k]) <= 0.0:
            hard += 1
    return hard >= free


@long_jit
def enter(Q: Any, q: int, code: int, side: int, lam: float) -> bool:
    """Append a row to the working set of q rows; False when it depends on them."""
    soft = _softness(Q, code, side)
    Q.code[q], Q.side[q], Q.lam[q] = code, side, lam
    _whiten(Q, code, q)
    _gram_row(Q, q, soft)
    if not _factor_row(Q, q, soft) or (soft <= 0.0 and _is_crowded(Q, q)):
        return False
    Q.t[q] = _gap(Q, code, side, Q.x_free, 0.0)
    if code >= Q.meq:
        Q.active[code - Q.meq] = 1
    return True


@jit
def enter_task_rows(Q: Any) -> bool:
    """All task rows into an empty working set; False when one depends on the others.

    For a diagonal H, G = A H^-1 A' + compliance is computed from A itself, so that nothing waits for V to
    reach memory; else V comes column by column, whose rows do not wait for each other.
    """
    n, m = Q.nx, Q.meq
    for k in range(m):
        Q.code[k], Q.side[k], Q.lam[k] = k, 0, 0.0
        row = Q.A[k]
        t = Q.b[k]
        for i in range(n):
            t -= row[i] * Q.x_free[i]
        Q.t[k] = t
    if Q.dense:
        for i in range(n):
            L = Q.L_H[i]
            works = 0.0 if Q.root[i] == 0.0 else L[i]
            for k in range(m):
                V = Q.V[k]
                s = Q.A[k, i]
                for j in range(i):
                    s -= L[j] * V[j]
                V[i] = s * works
        for k in range(m):
            _gram_row(Q, k, Q.soft[k])
    else:
        for k in range(m):
            row = Q.A[k]
            G = Q.G[k]
            for j in range(k + 1):
                other = Q.A[j]
                s = 0.0
                for i in range(n):
                    s += row[i] * other[i] * Q.inverse[i]
                G[j] = s
            G[k] += Q.soft[k]
        for k in range(m):
            row = Q.A[k]
            V = Q.V[k]
            for i in range(n):
                V[i] = row[i] * Q.root[i]
    for k in range(m):
        if not _factor_row(Q, k, Q.soft[k]):
            return False
    return True


@long_jit
def leave(Q: Any, q: int, k: int) -> int:
    """Take row k out of the working set of q rows; the new number of rows."""
    n = Q.nx
    Q.active[Q.code[k] - Q.meq] = 0
    for i in range(k, q - 1):
        Q.code[i], Q.side[i], Q.lam[i], Q.t[i] = Q.code[i + 1], Q.side[i + 1], Q.lam[i + 1], Q.t[i + 1]
        for j in range(n):
            Q.V[i, j] = Q.V[i + 1, j]
        for j in range(k):
            Q.G[i, j] = Q.G[i + 1, j]
        for j in range(k, i + 1):
            Q.G[i, j] = Q.G[i + 1, j + 1]
    for i in range(k, q - 1):
        _factor_row(Q, i, _softness(Q, Q.code[i], Q.side[i]))
    return q - 1


@jit
def solve_dual(Q: Any, q: int, x: Any) -> None:
    """x <- S^-1 x on the working set."""
    _substitute(Q.L, q, x)
    _back_substitute(Q.L, q, x)


@jit
def primal(Q: Any, q: int, lam: Any, x: Any) -> None:
    """x = H^(-1/2)' V' lam, the step away from x_free."""
    n = Q.nx
    for i in range(n):
        x[i] = 0.0
    for k in range(q):
        y = lam[k]
        V = Q.V[k]
        for i in range(n):
            x[i] += V[i] * y
    if Q.dense:
        _back_substitute(Q.L_H, n, x)
        for i in range(n):
            if Q.root[i] == 0.0:
                x[i] = 0.0
    else:
        for i in range(n):
            x[i] *= Q.root[i]


@jit
def refine(Q: Any, q: int) -> bool:
    """One step of refinement, S dlam = d - N x - compliance lam; False when nothing is left to do."""
    r = Q.lam_new
    worst = 0.0
    for k in range(q):
        code, side = Q.code[k], Q.side[k]
        s = _gap(Q, code, side, Q.x, -_softness(Q, code, side) * Q.lam[k])
        r[k] = s
        worst = max(worst, abs(s))
    if not worst > REFINE_FROM:
        return False
    solve_dual(Q, q, r)
    for k in range(q):
        Q.lam[k] += r[k]
    primal(Q, q, r, Q.scratch)
    for i in range(Q.nx):
        Q.x[i] += Q.scratch[i]
    return True
