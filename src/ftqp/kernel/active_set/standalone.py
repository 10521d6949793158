"""The active set for QPs that no robot made."""

from typing import Any

from ftqp.kernel.active_set.active_set import active_set
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import FAILED, MAX_ITERATIONS, SOLVED

PROXIMAL_STEPS = 200
"""Steps at most: a guess that the tests have not contradicted."""


@jit
def _proximal(Q: Any) -> int:
    """Solve for a semidefinite H: min f(x) + eps |x - x_k|^2/2 until x_k settles (proximal point)."""
    n = Q.nx
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(Q.H[i, i]))
    eps = 1e-6 * largest + 1e-8
    for i in range(n):
        Q.H[i, i] += eps
        Q.centre[i] = 0.0
        Q.g_given[i] = Q.g[i]
    code, total = MAX_ITERATIONS, 0
    for _ in range(PROXIMAL_STEPS):
        for i in range(n):
            Q.g[i] = Q.g_given[i] - eps * Q.centre[i]
        code = active_set(Q)
        total += Q.iterations
        if code != SOLVED:
            break
        moved, size = 0.0, 0.0
        for i in range(n):
            moved = max(moved, abs(Q.x[i] - Q.centre[i]))
            size = max(size, abs(Q.x[i]))
            Q.centre[i] = Q.x[i]
        if not size < 1e15:
            code = FAILED
            break
        if eps * moved <= 1e-11 * (1.0 + eps * size):
            break
        code = MAX_ITERATIONS
    for i in range(n):
        Q.H[i, i] -= eps
        Q.g[i] = Q.g_given[i]
    Q.iterations = total
    return code


@jit
def solve_standalone(Q: Any) -> int:
    """Solve a QP that stands alone: SOLVED, MAX_ITERATIONS, INFEASIBLE or FAILED."""
    code = active_set(Q)
    if code == FAILED:
        Q.warm = 0
        return _proximal(Q)
    return code
