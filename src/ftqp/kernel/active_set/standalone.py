"""The active set for QPs that no robot made, whose H may be semidefinite."""

from typing import Any

from ftqp.kernel.active_set.active_set import active_set
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import FAILED, MAX_ITERATIONS, SOLVED

STATIONARY = 1e-7
"""Largest |Hx + g + A'y + C'z + z_box| that shows no harm of a pivot that is rounding, as a share of 1 + the
largest of |Hx| and |g|: a tenth of what ``ftqp.qp.answer_check`` accepts."""
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
