"""The default solver: a warm-started dual active set with compliant equality rows.

    min 1/2 x'Hx + g'x + sum_k s_k^2 / (2 soft_k)   s.t.  A x + s = b,  lb <= x <= ub,  l <= C x <= u

The dual of a strictly convex QP has sign constraints only, so any working set with multipliers of the right
sign is a legal start: the last tick's is the warm start. On a working set with rows N (A, then bounds and
rows of C) and right sides d,

    S lam = d - N x_free,  S = N H^-1 N' + diag(compliance),  x = x_free + H^-1 N' lam,  x_free = -H^-1 g.

A multiplier of the wrong sign stops the step where it vanishes, and its row leaves. Where all signs are
right, the most violated bound or row enters; when none is violated, the QP is solved. soft = 0 gives hard
rows and soft > 0 the slack, at no extra variable. Fixed variables (lb = ub) are eliminated. H > 0.

Constraint codes: 0..meq-1 are the rows of A, meq.. the box, meq+nx.. the rows of C. ``side`` is +1 at a lower
end (lam >= 0), -1 at an upper end (lam <= 0), 0 at an equality. ``lam`` is the negative multiplier of the
Lagrangian f + y'(Ax - b) + z'Cx + z_box'x.
Source: Arnström 2022 for the dual view (DAQP); the compliant rows are an addition.
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
from ftqp.kernel.jit import jit, long_jit, rare_jit
from ftqp.kernel.layout.enums import FAILED, INFEASIBLE, MAX_ITERATIONS, SOLVED

REFINEMENTS = 3
"""How often a solution is refined at most."""


@jit
def _worst_violation(Q: Any) -> tuple[int, int, float]:
    """Code and side of the bound or row that x violates most, or -1, and by how much."""
    n, m = Q.nx, Q.meq
    worst, code, side = Q.tolerance, -1, 0
    for i in range(n):
        if Q.active[i] == 0 and Q.root[i] != 0.0:
            x = Q.x[i]
            if Q.lb[i] - x > worst:
                worst, code, side = Q.lb[i] - x, m + i, 1
            if x - Q.ub[i] > worst:
                worst, code, side = x - Q.ub[i], m + i, -1
    for j in range(Q.nc):
        if Q.active[n + j] == 0 and (Q.l[j] > -inf or Q.u[j] < inf):
            s = 0.0
            row = Q.C[j]
            for i in range(n):
                s += row[i] * Q.x[i]
            if Q.l[j] - s > worst:
                worst, code, side = Q.l[j] - s, m + n + j, 1
            if s - Q.u[j] > worst:
                worst, code, side = s - Q.u[j], m + n + j, -1
    return code, side, worst


@rare_jit
def _is_rounding(Q: Any, q: int, violation: float) -> bool:
    """Whether errors of ``tolerance`` in the q rows that a row depends on explain its violation."""
    weight = 1.0
    for i in range(q):
        weight += abs(Q.lam_new[i])
    return violation <= Q.tolerance * weight


@jit
def _start(Q: Any, warm: int) -> tuple[int, int]:
    """Fill the first working set: task rows, equality rows of C, then the last one; rows and equalities."""
    m, n = Q.meq, Q.nx
    for k in range(n + Q.nc):
        Q.active[k] = 0
    q = 0
    if m <= n and enter_task_rows(Q):
        q = m
    else:
        for k in range(m):
            if enter(Q, q, k, 0, 0.0):
                q += 1
    for j in range(Q.nc):
        if Q.l[j] == Q.u[j] and enter(Q, q, m + n + j, 0, 0.0):
            q += 1
    equalities = q
    for k in range(warm):
        code, side = Q.warm_code[k], Q.warm_side[k]
        if code < m + n:
            i = code - m
            if Q.root[i] == 0.0 or (Q.lb[i] if side > 0 else Q.ub[i]) in (inf, -inf):
                continue
        else:
            j = code - m - n
            if j >= Q.nc or Q.l[j] == Q.u[j] or (Q.l[j] if side > 0 else Q.u[j]) in (inf, -inf):
                continue
        if enter(Q, q, code, side, Q.warm_lam[k]):
            q += 1
    return q, equalities


@rare_jit
def _trade_places(Q: Any, q: int, equalities: int, side: int, lam: float) -> tuple[int, float, bool]:
    """The entering row q depends on the others: move along the null direction until a multiplier vanishes.

    Returns the rows left, the multiplier of the entering row, and False when none vanishes: the QP is
    infeasible.
    """
    r = Q.lam_new
    for i in range(q):
        r[i] = Q.L[q, i] * side
    for i in range(q - 1, -1, -1):
        r[i] *= Q.L[i, i]
        s = r[i]
        for j in range(i):
            r[j] -= Q.L[i, j] * s
    best, k = inf, -1
    for i in range(equalities, q):
        slope = r[i] * Q.side[i]
        if slope > 1e-13 and abs(Q.lam[i]) < best * slope:
            best, k = abs(Q.lam[i]) / slope, i
    if k < 0:
        return q, lam, False
    for i in range(q):
        Q.lam[i] -= best * r[i]
    return leave(Q, q, k), lam + best * side, True


@jit
def _publish(Q: Any, q: int, equalities: int) -> None:
    """Multipliers by the convention of ftqp.QP, and the working set for the next start."""
    n, m = Q.nx, Q.meq
    for k in range(m):
        Q.y[k] = 0.0
    for i in range(n):
        Q.z_box[i] = 0.0
    for j in range(Q.nc):
        Q.z[j] = 0.0
    for k in range(q):
        code = Q.code[k]
        if code < m:
            Q.y[code] = -Q.lam[k]
        elif code < m + n:
            Q.z_box[code - m] = -Q.lam[k]
        else:
            Q.z[code - m - n] = -Q.lam[k]
    Q.warm = q - equalities
    for k in range(equalities, q):
        w = k - equalities
        Q.warm_code[w], Q.warm_side[w], Q.warm_lam[w] = Q.code[k], Q.side[k], Q.lam[k]
    for i in range(n):  # stationarity gives the multipliers of fixed variables
        if Q.root[i] == 0.0:
            s = Q.g[i]
            if Q.dense:
                for j in range(n):
                    s += Q.H[i, j] * Q.x[j]
            else:
                s += Q.H_diagonal[i] * Q.x[i]
            for k in range(m):
                s += Q.A[k, i] * Q.y[k]
            for j in range(Q.nc):
                s += Q.C[j, i] * Q.z[j]
            Q.z_box[i] = -s


@jit
def _task_rows_hold(Q: Any) -> bool:
    """Whether the hard rows left out as dependent hold all the same."""
    n = Q.nx
    for k in range(Q.meq):
        if Q.soft[k] <= 0.0:
            s = Q.b[k]
            size = abs(Q.b[k])
            for i in range(n):
                s -= Q.A[k, i] * Q.x[i]
                size = max(size, abs(Q.A[k, i] * Q.x[i]))
            if not abs(s) <= 1e-8 * (1.0 + size):
                return False
    return True


@long_jit
def active_set(Q: Any) -> int:
    """Solve the QP from its last working set: SOLVED, MAX_ITERATIONS, INFEASIBLE or FAILED (H not > 0)."""
    warm = Q.warm
    Q.warm = 0
    Q.iterations = 0
    for i in range(Q.nx):
        if not Q.lb[i] <= Q.ub[i]:
            return INFEASIBLE
    for j in range(Q.nc):
        if not Q.l[j] <= Q.u[j]:
            return INFEASIBLE
    if not minimise_free(Q):
        return FAILED
    q, equalities = _start(Q, warm)
    working = len(Q.lam)
    for it in range(Q.max_iterations):
        for i in range(q):
            Q.lam_new[i] = Q.t[i]
        solve_dual(Q, q, Q.lam_new)
        step, k = 1.0, -1
        for i in range(equalities, q):
            if Q.lam_new[i] * Q.side[i] < 0.0:
                d = Q.lam[i] - Q.lam_new[i]
                f = Q.lam[i] / d if d != 0.0 else 0.0
                if f < step:
                    step, k = f, i
        if k >= 0:
            for i in range(q):
                Q.lam[i] += step * (Q.lam_new[i] - Q.lam[i])
            q = leave(Q, q, k)
            continue
        for i in range(q):
            Q.lam[i] = Q.lam_new[i]
        primal(Q, q, Q.lam, Q.x)
        for i in range(Q.nx):
            Q.x[i] += Q.x_free[i]
        for _ in range(REFINEMENTS):
            if not refine(Q, q):
                break
        code, side, violation = _worst_violation(Q)
        if code < 0:
            Q.iterations = it + 1
            if not _task_rows_hold(Q):
                return INFEASIBLE
            _publish(Q, q, equalities)
            return SOLVED
        lam = 0.0
        if q >= working:
            return FAILED
        possible = True
        while not enter(Q, q, code, side, lam):
            q, lam, possible = _trade_places(Q, q, equalities, side, lam)
            if not possible:
                break
        if possible:
            q += 1
        elif _is_rounding(Q, q, violation):
            Q.active[code - Q.meq] = 1  # met as well as rounding lets it: no longer looked at
        else:
            Q.iterations = it + 1
            return INFEASIBLE
    Q.iterations = Q.max_iterations
    return MAX_ITERATIONS


STATIONARY = 1e-7
"""Largest |Hx + g + A'y + C'z + z_box| that shows no harm of a pivot that is rounding, as a share of 1 + the
largest of |Hx| and |g|: a tenth of what ``ftqp.qp.solving`` accepts."""
FIRST_WEIGHT, FALL, LEAST_WEIGHT = 1e-2, 0.1, 1e-6
"""The proximal weight begins at a share of the size of the objective and falls by a factor each step: a large
one is well conditioned, a small one goes far. Of twelve choices this one let none of 1,018 QPs of
``python solvers/compare_semidefinite.py`` run into a cap, in 15 steps at most and 5 in the median."""
SETTLED = 1e-10
"""Pull towards the last point, as a share of the size of the objective, that counts as none: what it leaves
of stationarity. A convention, the same as ``ftqp.kernel.entry.workspace.TOLERANCE``."""
PROXIMAL_STEPS = 200
"""Steps at most: a guess, more than ten times what the QPs above took."""


@jit
def _proximal(Q: Any) -> int:
    """Solve for a semidefinite H: min f(x) + w_k |x - x_k|^2/2 until x_k settles (proximal point)."""
    n = Q.nx
    size = 0.0
    for i in range(n):
        size = max(size, Q.H[i, i], abs(Q.g[i]))
        Q.centre[i], Q.g_given[i], Q.diagonal_given[i] = 0.0, Q.g[i], Q.H[i, i]
    if size == 0.0:
        size = 1.0
    weight = FIRST_WEIGHT * size
    code, total = MAX_ITERATIONS, 0
    for _ in range(PROXIMAL_STEPS):
        for i in range(n):
            Q.H[i, i] = Q.diagonal_given[i] + weight
            Q.g[i] = Q.g_given[i] - weight * Q.centre[i]
        code = active_set(Q)
        total += Q.iterations
        if code != SOLVED:
            break
        moved, far = 0.0, 0.0
        for i in range(n):
            moved = max(moved, abs(Q.x[i] - Q.centre[i]))
            far = max(far, abs(Q.x[i]))
            Q.centre[i] = Q.x[i]
        if not far < 1e15:
            code = FAILED
            break
        if weight * moved <= SETTLED * size:
            break
        code = MAX_ITERATIONS
        weight = max(FALL * weight, LEAST_WEIGHT * size)
    for i in range(n):
        Q.H[i, i] = Q.diagonal_given[i]
        Q.g[i] = Q.g_given[i]
    Q.iterations = total
    return code


@jit
def _is_stationary(Q: Any) -> bool:
    """Whether Hx + g + A'y + C'z + z_box vanishes, which it does not where a pivot of H was rounding."""
    worst, size = 0.0, 1.0
    for i in range(Q.nx):
        s = 0.0
        for j in range(Q.nx):
            s += Q.H[i, j] * Q.x[j]
        size = max(size, 1.0 + abs(s), 1.0 + abs(Q.g[i]))
        s += Q.g[i] + Q.z_box[i]
        for k in range(Q.meq):
            s += Q.A[k, i] * Q.y[k]
        for k in range(Q.nc):
            s += Q.C[k, i] * Q.z[k]
        worst = max(worst, abs(s))
    return worst <= STATIONARY * size


@jit
def solve_standalone(Q: Any) -> int:
    """Solve a QP that stands alone: SOLVED, MAX_ITERATIONS, INFEASIBLE or FAILED.

    The factor of a semidefinite H may have pivots that are nothing but rounding. So only an answer that holds
    is taken from it, and whatever else is said is asked again of H that is made definite.
    """
    code = active_set(Q)
    if code == SOLVED and _is_stationary(Q):
        return code
    Q.warm = 0
    return _proximal(Q)
