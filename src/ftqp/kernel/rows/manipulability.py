"""The posture criterion that leads away from singularities: the gradient of the manipulability."""

from typing import Any

from ftqp.kernel.arm.mimicry import columns, fold_row
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.maths.cholesky import factor, solve_factored
from ftqp.kernel.maths.vectors import cross

FLOOR = 0.01
"""Singular values below FLOOR lengths count as about that, so that the gradient stays finite."""


@jit
def _along_rows(task: Any, kinematics: Any, scratch: Any) -> tuple[float, float, float, float, float, float]:
    """The six-vector along W that the row coefficients in t stand for."""
    f0 = f1 = f2 = m0 = m1 = m2 = 0.0
    for k in range(task.m):
        c = task.rows[k]
        s = task.row_scale[c] * scratch.rows[k]
        if c == 0:
            f0 += s
        elif c == 1:
            f1 += s
        elif c == 2:
            f2 += s
        elif not task.tool_rows:
            m0 += s if c == 3 else 0.0
            m1 += s if c == 4 else 0.0
            m2 += s if c == 5 else 0.0
        else:
            a = c - 3
            m0 += s * (
                kinematics.R_tip[0] * task.axis[a]
                + kinematics.R_tip[1] * task.axis[3 + a]
                + kinematics.R_tip[2] * task.axis[6 + a]
            )
            m1 += s * (
                kinematics.R_tip[3] * task.axis[a]
                + kinematics.R_tip[4] * task.axis[3 + a]
                + kinematics.R_tip[5] * task.axis[6 + a]
            )
            m2 += s * (
                kinematics.R_tip[6] * task.axis[a]
                + kinematics.R_tip[7] * task.axis[3 + a]
                + kinematics.R_tip[8] * task.axis[6 + a]
            )
    return f0, f1, f2, m0, m1, m2


@jit
def manipulability_gradient(K: Any) -> None:
    """d/dq_i log sqrt det S, S = A_f A_f' + (FLOOR length)^2 I, = sum_j (dA_j/dq_i)' S^-1 A_j, into scratch.

    A_f are the columns of the working joints j. With column (v_j; w_j) of the geometric Jacobian, w_j = 0 for
    a prismatic joint,

        d/dq_i (v_j; w_j) = (w_i x v_j; w_i x w_j)  for i <= j,   (w_j x v_i; 0)  for i > j;

    with rows along the tool's axes the angular part is 0 and w_j x w_i instead. It needs ``task_rows``, not
    turned.
    Source: Yoshikawa 1985 for the measure; its floor keeps the gradient finite at a singularity.
    """
    chain, faults, kinematics, task, qp, scratch = K.chain, K.faults, K.kinematics, K.task, K.qp, K.scratch
    n, m = chain.n, task.m
    S, gradient, J = scratch.square, scratch.joints, columns(kinematics, chain)
    for a in range(m):
        for b in range(m):
            s = 0.0
            for k in range(faults.working):
                j = faults.order[k]
                s += qp.A[a, j] * qp.A[b, j]
            S[a, b] = s
        S[a, a] += (FLOOR * task.length) ** 2
    for i in range(n):
        gradient[i] = 0.0
    if not factor(S, m):
        return
    for column in range(faults.working):
        j = faults.order[column]
        for k in range(m):
            scratch.rows[k] = chain.ratio[j] * qp.A[k, chain.lead[j]]
        solve_factored(S, m, scratch.rows)
        f0, f1, f2, m0, m1, m2 = _along_rows(task, kinematics, scratch)
        w0, w1, w2 = J[3, j], J[4, j], J[5, j]
        for i in range(n):
            x0 = x1 = x2 = 0.0
            y0 = y1 = y2 = 0.0
            u0, u1, u2 = J[3, i], J[4, i], J[5, i]
            if i <= j:
                if not chain.prismatic[i]:
                    x0, x1, x2 = cross(u0, u1, u2, J[0, j], J[1, j], J[2, j])
                    if not task.tool_rows:
                        y0, y1, y2 = cross(u0, u1, u2, w0, w1, w2)
            else:
                x0, x1, x2 = cross(w0, w1, w2, J[0, i], J[1, i], J[2, i])
                if task.tool_rows and not chain.prismatic[i]:
                    y0, y1, y2 = cross(w0, w1, w2, u0, u1, u2)
            gradient[i] += f0 * x0 + f1 * x1 + f2 * x2 + m0 * y0 + m1 * y1 + m2 * y2
    if chain.mimics:
        fold_row(chain, gradient)


@part_jit
def add_manipulability(K: Any) -> None:
    """g -= gain d/dq log w: with |x|^2/2 beside it, x is drawn towards gain times the gradient."""
    chain, criteria, qp, scratch = K.chain, K.criteria, K.qp, K.scratch
    manipulability_gradient(K)
    for i in range(chain.n):
        qp.g[i] -= criteria.manipulability * scratch.joints[i]
