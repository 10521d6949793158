"""The assembled QP in the standard form that external solvers take, and their answer back.

The compliance of a task row becomes a slack variable t with A x + sqrt(soft h) t = b and cost h t^2/2, where
h is the mean
diagonal of H: the same problem, scaled so that a first-order method is not hurt. Variables: joints, path
scale (scaled mode),
slacks (every mode but hard). Rows of C: one a joint if the robot has inertia. Sizes never change in a
planner's life.
"""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import HARD, SCALE


@jit
def sizes(K: Any) -> tuple[int, int, int]:
    """Variables, equality rows and two-sided rows of the external QP."""
    variables = K.n + (1 if K.mode == SCALE else 0) + (0 if K.mode == HARD else K.m)
    return variables, K.m, K.p


@jit
def pack(K: Any, flat: Any) -> None:
    """Write H, g, A, C, lb, b, l, ub, b, u one after the other, matrices by rows, into ``flat``."""
    n, m, p = sizes(K)
    nx = K.nx
    mean = 0.0
    for i in range(K.n):
        mean += K.H[i, i] if K.dense else K.H_diagonal[i]
    mean /= K.n
    at = 0
    for i in range(nx):
        if K.dense:
            for j in range(nx):
                flat[at + j] = K.H[i, j]
        else:
            for j in range(nx):
                flat[at + j] = 0.0
            flat[at + i] = K.H_diagonal[i]
        at += n
    for i in range(nx, n):
        flat[at + i] = mean
        at += n
    for i in range(n):
        flat[at + i] = K.g[i] if i < nx else 0.0
    at += n
    for k in range(m):
        for i in range(nx):
            flat[at + i] = K.A[k, i]
        if n > nx:
            flat[at + nx + k] = sqrt(K.soft[k] * mean)
        at += n
    for j in range(p):
        for i in range(K.n):
            flat[at + i] = K.C[j, i] if K.nc > 0 else 0.0
        at += n
    k = n + m + p
    for i in range(n):
        flat[at + i] = K.lb[i] if i < nx else -inf
        flat[at + k + i] = K.ub[i] if i < nx else inf
    at += n
    for i in range(m):
        flat[at + i] = flat[at + k + i] = K.b[i]
    at += m
    for j in range(p):
        flat[at + j] = K.l[j] if K.nc > 0 else -inf
        flat[at + k + j] = K.u[j] if K.nc > 0 else inf


@jit
def unpack(K: Any, flat: Any) -> None:
    """Read x, z_box, y, z, one after the other in ``flat``, back into the record."""
    n, m, _ = sizes(K)
    for i in range(K.nx):
        K.x[i] = flat[i]
        K.z_box[i] = flat[n + i]
    for k in range(m):
        K.y[k] = flat[2 * n + k]
    for j in range(K.nc):
        K.z[j] = flat[2 * n + m + j]
