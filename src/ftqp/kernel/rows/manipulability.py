"""The posture criterion that leads away from singularities: the gradient of the manipulability."""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import HEALTHY
from ftqp.kernel.maths.cholesky import factor, solve_factored
from ftqp.kernel.maths.vectors import cross

FLOOR = 0.01
"""The manipulability counts singular values below FLOOR lengths as about that, so its gradient stays
finite."""


@jit
def _along_rows(K: Any) -> tuple[float, float, float, float, float, float]:
    """The six-vector along W that the row coefficients in t stand for."""
    f0 = f1 = f2 = m0 = m1 = m2 = 0.0
    for k in range(K.m):
        c = K.rows[k]
        s = K.row_scale[c] * K.t[k]
        if c == 0:
            f0 += s
        elif c == 1:
            f1 += s
        elif c == 2:
            f2 += s
        elif not K.tool_rows:
            m0 += s if c == 3 else 0.0
            m1 += s if c == 4 else 0.0
            m2 += s if c == 5 else 0.0
        else:
            a = c - 3
            m0 += s * (K.R_tip[0] * K.axis[a] + K.R_tip[1] * K.axis[3 + a] + K.R_tip[2] * K.axis[6 + a])
            m1 += s * (K.R_tip[3] * K.axis[a] + K.R_tip[4] * K.axis[3 + a] + K.R_tip[5] * K.axis[6 + a])
            m2 += s * (K.R_tip[6] * K.axis[a] + K.R_tip[7] * K.axis[3 + a] + K.R_tip[8] * K.axis[6 + a])
    return f0, f1, f2, m0, m1, m2


@jit
def manipulability_gradient(K: Any) -> None:
    """d/dq_i log sqrt det(A_f A_f' + (FLOOR length)^2 I) = sum_j (dA_j/dq_i)'(A_f A_f' + ...)^-1 A_j, into
    scratch.

    A_f are the columns of the healthy joints j. With column (v_j; w_j) of the geometric Jacobian, w_j = 0 for
    a
    prismatic joint:  d/dq_i (v_j; w_j) = (w_i x v_j; w_i x w_j) for i <= j, (w_j x v_i; 0) for i > j; with
    rows
    along the tool's axes the angular part is 0 and w_j x w_i instead. Needs ``task_rows``, not turned.
    Source: Yoshikawa, IJRR 1985, for the measure; its floor keeps the gradient finite at a singularity.
    """
    n, m = K.n, K.m
    S, gradient = K.L_H, K.scratch
    for a in range(m):
        for b in range(m):
            s = 0.0
            for j in range(n):
                if K.fault[j] == HEALTHY:
                    s += K.A[a, j] * K.A[b, j]
            S[a, b] = s
        S[a, a] += (FLOOR * K.length) ** 2
    for i in range(n):
        gradient[i] = 0.0
    if not factor(S, m):
        return
    for j in range(n):
        if K.fault[j] != HEALTHY:
            continue
        for k in range(m):
            K.t[k] = K.A[k, j]
        solve_factored(S, m, K.t)
        f0, f1, f2, m0, m1, m2 = _along_rows(K)
        turns = 0.0 if K.prismatic[j] else 1.0
        w0, w1, w2 = turns * K.axis_w[j, 0], turns * K.axis_w[j, 1], turns * K.axis_w[j, 2]
        for i in range(n):
            x0 = x1 = x2 = 0.0
            y0 = y1 = y2 = 0.0
            u0, u1, u2 = K.axis_w[i, 0], K.axis_w[i, 1], K.axis_w[i, 2]
            if i <= j:
                if not K.prismatic[i]:
                    x0, x1, x2 = cross(u0, u1, u2, K.J[0, j], K.J[1, j], K.J[2, j])
                    if not K.tool_rows:
                        y0, y1, y2 = cross(u0, u1, u2, w0, w1, w2)
            else:
                x0, x1, x2 = cross(w0, w1, w2, K.J[0, i], K.J[1, i], K.J[2, i])
                if K.tool_rows and not K.prismatic[i]:
                    y0, y1, y2 = cross(w0, w1, w2, u0, u1, u2)
            gradient[i] += f0 * x0 + f1 * x1 + f2 * x2 + m0 * y0 + m1 * y1 + m2 * y2


@jit
def add_manipulability(K: Any) -> None:
    """g -= gain d/dq log w: with |x|^2/2 beside it, x is drawn towards gain times the gradient."""
    manipulability_gradient(K)
    for i in range(K.n):
        K.g[i] -= K.manipulability * K.scratch[i]
