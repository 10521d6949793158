"""The QP of most ticks, where no limit holds: solved and judged in one pass, eight joints at once.

    S lam = b - A x_free,  S = A H^-1 A' + diag(soft),  x = x_free + H^-1 A' lam,  x_free = -H^-1 g

with joints that have failed fixed at their prescribed x, and H diagonal or, beside soft tasks, inverted as a
whole. It is what the active set comes to when no bound enters; where one would, or a row depends on the
others, the active set takes over.
"""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.active_set.active_set import REFINEMENTS
from ftqp.kernel.active_set.working_set import DEPENDENT, REFINE_FROM
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.maths.elementary import any_of, larger, select
from ftqp.kernel.maths.side_by_side import (
    WIDTH,
    is_set,
    lane_mask,
    largest_of,
    load_lanes,
    store_lanes,
    sum_of,
)


@jit
def _minimise_free(faults: Any, chain: Any, qp: Any) -> bool:
    """H^-1, zero for a joint that has failed, and x_free; whether H > 0."""
    n = chain.n
    for at in range(0, chain.n, WIDTH):
        inside = lane_mask(n, at)
        held = is_set(faults.code, at) | ~inside
        H = select(held, 1.0, load_lanes(qp.H_diagonal, at))
        if any_of(~(H > 0.0)):
            return False
        inverse = select(held, 0.0, 1.0 / H)
        fixed = select(inside, load_lanes(qp.lb, at), 0.0)
        store_lanes(qp.inverse, at, inverse)
        store_lanes(qp.x_free, at, select(held, fixed, -load_lanes(qp.g, at) * inverse))
    return True


@jit
def _is(joint: int, at: int) -> Any:
    """Which of the joints at .. at + 7 is the one."""
    return lane_mask(joint + 1, at) & ~lane_mask(joint, at)


@jit
def _invert(faults: Any, chain: Any, qp: Any) -> bool:
    """H^-1 over the joints that work, 1 on the diagonal of the others, into ``L_H``; whether H > 0."""
    n, S = chain.n, qp.L_H
    for i in range(n):
        works = 0.0 if faults.code[i] else 1.0
        for at in range(0, n, WIDTH):
            row = select(is_set(faults.code, at) | ~lane_mask(n, at), 0.0, works * load_lanes(qp.H[i], at))
            store_lanes(S[i], at, select(_is(i, at), row + (1.0 - works), row))
    for k in range(n):  # Gauss and Jordan, who need no pivots for H > 0, in whole blocks
        pivot = S[k, k]
        if not pivot > 0.0:
            return False
        inverse = 1.0 / pivot
        for at in range(0, n, WIDTH):
            store_lanes(S[k], at, inverse * select(_is(k, at), 1.0, load_lanes(S[k], at)))
        for i in range(n):
            if i != k:
                f = S[i, k]
                for at in range(0, n, WIDTH):
                    row = select(_is(k, at), 0.0, load_lanes(S[i], at))
                    store_lanes(S[i], at, row - f * load_lanes(S[k], at))
    return True


@jit
def _times_inverse(chain: Any, qp: Any, x: Any, y: Any) -> None:
    """y <- H^-1 x."""
    n = chain.n
    for at in range(0, n, WIDTH):
        s = load_lanes(x, at) * 0.0
        for j in range(n):
            s = s + x[j] * load_lanes(qp.L_H[j], at)
        store_lanes(y, at, s)


@jit
def _minimise_free_dense(faults: Any, chain: Any, qp: Any) -> bool:
    """H^-1 and x_free of criteria that couple joints; whether H > 0."""
    n = chain.n
    if not _invert(faults, chain, qp):
        return False
    for i in range(n):
        if faults.code[i]:
            qp.scratch[i] = qp.lb[i]
            continue
        s = load_lanes(qp.g, 0) * 0.0
        for at in range(0, n, WIDTH):
            held = is_set(faults.code, at) & lane_mask(n, at)
            s = s + select(held, load_lanes(qp.H[i], at) * load_lanes(qp.lb, at), 0.0)
        qp.scratch[i] = -qp.g[i] - sum_of(s)
    _times_inverse(chain, qp, qp.scratch, qp.x_free)
    return True


@jit
def _pose_dual(faults: Any, chain: Any, qp: Any) -> None:
    """V = A H^-1, S and t = b - A x_free."""
    width = chain.n
    for k in range(qp.meq):
        row, V, G = qp.A[k], qp.V[k], qp.G[k]
        t = load_lanes(row, 0) * 0.0
        if qp.dense:
            _times_inverse(chain, qp, row, V)
        for at in range(0, width, WIDTH):
            a = load_lanes(row, at)
            if qp.dense:
                store_lanes(
                    V, at, select(is_set(faults.code, at) | ~lane_mask(width, at), 0.0, load_lanes(V, at))
                )
            else:
                store_lanes(V, at, a * load_lanes(qp.inverse, at))
            t = t + a * load_lanes(qp.x_free, at)
        qp.t[k] = qp.b[k] - sum_of(t)
        for j in range(k + 1):
            other = qp.A[j]
            s = load_lanes(V, 0) * load_lanes(other, 0)
            for at in range(WIDTH, width, WIDTH):
                s = s + load_lanes(V, at) * load_lanes(other, at)
            G[j] = sum_of(s)
        G[k] += qp.soft[k]


@jit
def _factor(qp: Any) -> bool:
    """S = L D L', L with D^-1 on its diagonal; False where a row depends on those before it."""
    for k in range(qp.meq):
        G, L = qp.G[k], qp.L[k]
        pivot = G[k]
        for j in range(k):
            s = G[j]
            for i in range(j):
                s -= G[i] * qp.L[j, i]
            G[j] = s
            L[j] = s * qp.L[j, j]
            pivot -= s * L[j]
        if not pivot > DEPENDENT * G[k]:
            return False
        L[k] = 1.0 / pivot
    return True


@jit
def _factor_six(qp: Any) -> bool:
    """The same of six rows, in registers.

    Pivots p_k with reciprocals r_k; the rows b to f of L are b0; c0, c1; and so on. t, u, v and w are what
    the first, second, third and fourth pivot leave of the columns of S behind them.
    """
    L, a, b, c, d, e, f = qp.L, qp.G[0], qp.G[1], qp.G[2], qp.G[3], qp.G[4], qp.G[5]
    p0 = a[0]
    r0 = 1.0 / p0
    b0, c0, d0, e0, f0 = b[0] * r0, c[0] * r0, d[0] * r0, e[0] * r0, f[0] * r0
    p1 = b[1] - b[0] * b0
    r1 = 1.0 / p1
    t2, t3, t4, t5 = c[1] - c[0] * b0, d[1] - d[0] * b0, e[1] - e[0] * b0, f[1] - f[0] * b0
    c1, d1, e1, f1 = t2 * r1, t3 * r1, t4 * r1, t5 * r1
    p2 = c[2] - c[0] * c0 - t2 * c1
    r2 = 1.0 / p2
    u3, u4 = d[2] - d[0] * c0 - t3 * c1, e[2] - e[0] * c0 - t4 * c1
    u5 = f[2] - f[0] * c0 - t5 * c1
    d2, e2, f2 = u3 * r2, u4 * r2, u5 * r2
    p3 = d[3] - d[0] * d0 - t3 * d1 - u3 * d2
    r3 = 1.0 / p3
    v4 = e[3] - e[0] * d0 - t4 * d1 - u4 * d2
    v5 = f[3] - f[0] * d0 - t5 * d1 - u5 * d2
    e3, f3 = v4 * r3, v5 * r3
    p4 = e[4] - e[0] * e0 - t4 * e1 - u4 * e2 - v4 * e3
    r4 = 1.0 / p4
    w5 = f[4] - f[0] * e0 - t5 * e1 - u5 * e2 - v5 * e3
    f4 = w5 * r4
    p5 = f[5] - f[0] * f0 - t5 * f1 - u5 * f2 - v5 * f3 - w5 * f4
    L[0, 0], L[1, 1], L[2, 2], L[3, 3], L[4, 4], L[5, 5] = r0, r1, r2, r3, r4, 1.0 / p5
    L[1, 0], L[2, 0], L[3, 0], L[4, 0], L[5, 0] = b0, c0, d0, e0, f0
    L[2, 1], L[3, 1], L[4, 1], L[5, 1] = c1, d1, e1, f1
    L[3, 2], L[4, 2], L[5, 2] = d2, e2, f2
    L[4, 3], L[5, 3], L[5, 4] = e3, f3, f4
    first = p0 > 0.0 and p1 > DEPENDENT * b[1] and p2 > DEPENDENT * c[2]
    return bool(first and p3 > DEPENDENT * d[3] and p4 > DEPENDENT * e[4] and p5 > DEPENDENT * f[5])


@jit
def _solve_six(qp: Any, x: Any) -> None:
    """x <- S^-1 x of six rows, likewise."""
    L = qp.L
    x0 = x[0]
    x1 = x[1] - L[1, 0] * x0
    x2 = x[2] - L[2, 0] * x0 - L[2, 1] * x1
    x3 = x[3] - L[3, 0] * x0 - L[3, 1] * x1 - L[3, 2] * x2
    x4 = x[4] - L[4, 0] * x0 - L[4, 1] * x1 - L[4, 2] * x2 - L[4, 3] * x3
    x5 = x[5] - L[5, 0] * x0 - L[5, 1] * x1 - L[5, 2] * x2 - L[5, 3] * x3 - L[5, 4] * x4
    x5 = x5 * L[5, 5]
    x4 = x4 * L[4, 4] - L[5, 4] * x5
    x3 = x3 * L[3, 3] - L[5, 3] * x5 - L[4, 3] * x4
    x2 = x2 * L[2, 2] - L[5, 2] * x5 - L[4, 2] * x4 - L[3, 2] * x3
    x1 = x1 * L[1, 1] - L[5, 1] * x5 - L[4, 1] * x4 - L[3, 1] * x3 - L[2, 1] * x2
    x0 = x0 * L[0, 0] - L[5, 0] * x5 - L[4, 0] * x4 - L[3, 0] * x3 - L[2, 0] * x2 - L[1, 0] * x1
    x[0], x[1], x[2], x[3], x[4], x[5] = x0, x1, x2, x3, x4, x5


@jit
def _solve(qp: Any, x: Any) -> None:
    """x <- S^-1 x."""
    m, L = qp.meq, qp.L
    if m == 6:
        _solve_six(qp, x)
        return
    for k in range(1, m):
        s = x[k]
        for j in range(k):
            s -= L[k, j] * x[j]
        x[k] = s
    for k in range(m - 1, -1, -1):
        s = x[k] * L[k, k]
        for j in range(k + 1, m):
            s -= L[j, k] * x[j]
        x[k] = s


@jit
def _add(chain: Any, qp: Any, x: Any, lam: Any) -> None:
    """qp.x <- x + H^-1 A' lam."""
    for at in range(0, chain.n, WIDTH):
        s = load_lanes(x, at)
        for k in range(qp.meq):
            s = s + lam[k] * load_lanes(qp.V[k], at)
        store_lanes(qp.x, at, s)


@jit
def _left(task: Any, cascade: Any, chain: Any, qp: Any) -> float:
    """What is left of A x + soft lam = b into ``lam_new``, the slack, and the largest of what is left."""
    worst = size = 0.0
    for k in range(qp.meq):
        row = qp.A[k]
        t = load_lanes(row, 0) * load_lanes(qp.x, 0)
        for at in range(WIDTH, chain.n, WIDTH):
            t = t + load_lanes(row, at) * load_lanes(qp.x, at)
        s = sum_of(t)
        task.slack[k] = s - task.asked[k]
        r = qp.b[k] - s - qp.soft[k] * qp.lam[k]
        qp.lam_new[k] = r
        worst, size = max(worst, abs(r)), max(size, abs(qp.b[k]))
    cascade.residual_task = worst / (1.0 + size)
    return worst


@jit
def _is_optimal(faults: Any, cascade: Any, chain: Any, qp: Any) -> bool:
    """Whether x is within its bounds and every residual small; multipliers of the joints that are held."""
    worst = size = load_lanes(qp.x, 0) * 0.0
    for at in range(0, chain.n, WIDTH):
        inside, failed = lane_mask(chain.n, at), is_set(faults.code, at)
        x, g = load_lanes(qp.x, at), load_lanes(qp.g, at)
        fits = (load_lanes(qp.lb, at) <= x) & (x <= load_lanes(qp.ub, at)) & (abs(x) < inf)
        if any_of(inside & ~fits):
            return False
        s = load_lanes(qp.H_diagonal, at) * x
        if qp.dense:
            s = x * 0.0
            for j in range(chain.n):
                s = s + qp.x[j] * load_lanes(qp.H[j], at)
        r, squares = g + s, g * g + s * s
        for k in range(qp.meq):
            s = qp.lam[k] * load_lanes(qp.A[k], at)
            r, squares = r - s, squares + s * s
        worst = larger(worst, select(inside & ~failed, abs(r), 0.0))
        size = size + select(inside, squares, 0.0)
        store_lanes(qp.z_box, at, select(inside & failed, -r, 0.0))
    total = sum_of(size)
    cascade.residual_bounds = 0.0
    cascade.residual_dual = largest_of(worst) / (1.0 + sqrt(total))
    return bool(
        total < inf and cascade.residual_task <= cascade.accept and cascade.residual_dual <= cascade.accept
    )


@part_jit
def unconstrained_solve(K: Any) -> bool:
    """Whether the QP is solved without a limit: x, multipliers, residuals and slack are then there.

    It takes a QP whose last answer had no limit either, without rows of C or variables beside the joints; of
    those whose criteria couple joints only those of soft tasks, for others may be nearly singular. Else, and
    where it is False, nothing but scratch memory has changed.
    """
    cascade, qp = K.cascade, K.qp
    if qp.warm > 0 or qp.nc > 0 or qp.nx != K.chain.n or qp.meq == 0 or cascade.external:
        return False
    if (qp.dense and K.terms.count == 0) or K.faults.movable > K.faults.working:
        return False
    if qp.dense:
        if not _minimise_free_dense(K.faults, K.chain, qp):
            return False
    elif not _minimise_free(K.faults, K.chain, qp):
        return False
    _pose_dual(K.faults, K.chain, qp)
    m = qp.meq
    if not (_factor_six(qp) if m == 6 else _factor(qp)):
        return False
    for k in range(m):
        qp.lam[k] = qp.t[k]
    _solve(qp, qp.lam)
    _add(K.chain, qp, qp.x_free, qp.lam)
    worst = _left(K.task, cascade, K.chain, qp)
    for _ in range(REFINEMENTS):
        if not worst > REFINE_FROM:
            break
        _solve(qp, qp.lam_new)
        for k in range(m):
            qp.lam[k] += qp.lam_new[k]
        _add(K.chain, qp, qp.x, qp.lam_new)
        worst = _left(K.task, cascade, K.chain, qp)
    if not _is_optimal(K.faults, cascade, K.chain, qp):
        return False
    for k in range(m):
        qp.y[k] = -qp.lam[k]
    qp.iterations = 1
    return True
