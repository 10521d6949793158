"""The assembled QP in the standard form that external solvers take, and their answer back.

The compliance of a task row becomes a slack variable t with A x + sqrt(soft h) t = b and cost h t^2/2, where
h is the mean diagonal of H: this is the same problem, scaled so that a first-order method is not hurt. The
variables are the joints, the path scale (in scaled mode) and the slacks (in every mode but hard); the rows of
C are those of ``ftqp.kernel.layout.rows``. Sizes never change in a planner's life.
"""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import HARD, SCALE


@jit
def sizes(task: Any, cascade: Any, chain: Any) -> tuple[int, int, int]:
    """Variables, equality rows and two-sided rows of the external QP."""
    variables = chain.n + (1 if task.mode == SCALE else 0) + (0 if task.mode == HARD else task.m)
    return variables, task.m, cascade.p


@jit
def packed_size(task: Any, cascade: Any, chain: Any) -> int:
    """Numbers that ``pack`` writes."""
    n, m, p = sizes(task, cascade, chain)
    return n * n + n + (m + p) * n + 2 * (n + m + p)


@jit
def solution_size(task: Any, cascade: Any, chain: Any) -> int:
    """Numbers that ``unpack`` reads."""
    n, m, p = sizes(task, cascade, chain)
    return 2 * n + m + p


@jit
def pack(task: Any, cascade: Any, chain: Any, qp: Any, flat: Any) -> None:
    """Write H, g, A, C, lb, b, l, ub, b, u one after the other, matrices by rows, into ``flat``."""
    n, m, p = sizes(task, cascade, chain)
    nx = qp.nx
    mean = 0.0
    for i in range(chain.n):
        mean += qp.H[i, i] if qp.dense else qp.H_diagonal[i]
    mean /= chain.n
    at = 0
    for i in range(nx):
        if qp.dense:
            for j in range(nx):
                flat[at + j] = qp.H[i, j]
        else:
            for j in range(nx):
                flat[at + j] = 0.0
            flat[at + i] = qp.H_diagonal[i]
        at += n
    for i in range(nx, n):
        flat[at + i] = mean
        at += n
    for i in range(n):
        flat[at + i] = qp.g[i] if i < nx else 0.0
    at += n
    for k in range(m):
        for i in range(nx):
            flat[at + i] = qp.A[k, i]
        if n > nx:
            flat[at + nx + k] = sqrt(qp.soft[k] * mean)
        at += n
    for j in range(p):
        for i in range(chain.n):
            flat[at + i] = qp.C[j, i] if qp.nc > 0 else 0.0
        at += n
    k = n + m + p
    for i in range(n):
        flat[at + i] = qp.lb[i] if i < nx else -inf
        flat[at + k + i] = qp.ub[i] if i < nx else inf
    at += n
    for i in range(m):
        flat[at + i] = flat[at + k + i] = qp.b[i]
    at += m
    for j in range(p):
        flat[at + j] = qp.l[j] if qp.nc > 0 else -inf
        flat[at + k + j] = qp.u[j] if qp.nc > 0 else inf


@jit
def unpack(task: Any, cascade: Any, chain: Any, qp: Any, flat: Any) -> None:
    """Read x, z_box, y, z, one after the other in ``flat``, back into the record."""
    n, m, _ = sizes(task, cascade, chain)
    for i in range(qp.nx):
        qp.x[i] = flat[i]
        qp.z_box[i] = flat[n + i]
    for k in range(m):
        qp.y[k] = flat[2 * n + k]
    for j in range(qp.nc):
        qp.z[j] = flat[2 * n + m + j]
