"""The exact curvature of the task's error: M = A'A + S is the Hessian of E = e'e/2 over the joints."""

from math import cos, sin, sqrt
from typing import Any

from ftqp.kernel.arm.kinematics import columns, fold_square
from ftqp.kernel.jit import jit
from ftqp.kernel.maths.linear_systems import assign, plus_products
from ftqp.kernel.maths.vectors import column, cross, inner, length, three, three_from
from ftqp.kernel.rows.task_rows import component_of, tool_axis

STRAIGHT = 1e-4
"""A rotation error below this [rad] has no curvature of its own. That is left out because it is |e|^2/3 of
the plain one at most, 3e-9."""
STEEPEST = 3.0
"""Most that the curvature of an axis error counts across its own direction, as a multiple of the plain one;
at a half turn it is endless."""


@jit
def weigh_rows(task: Any, kinematics: Any, chain: Any, qp: Any, settling: Any) -> float:
    """Rows and error of the task as its priority weighs them, times 1/sqrt(yielding); e'e."""
    n = chain.n
    square = 0.0
    for k in range(task.m):
        c = task.rows[k]
        w = 1.0 / sqrt(task.yielding[c])
        for i in range(n):
            settling.A[k, i] = w * qp.A[k, i]
        e = w * task.row_scale[c] * component_of(task, kinematics, c, 0, task.error)
        settling.e[k] = e
        square += e * e
    return square


@jit
def weighted_error(task: Any, settling: Any) -> None:
    """The error vector along W with only the rows of the task, weighted twice: what S is linear in."""
    v = settling.weighted
    v[:6] = 0.0
    for k in range(task.m):
        c = task.rows[k]
        if c < 3 or not task.tool_rows:
            v[c] = task.row_scale[c] * task.row_scale[c] / task.yielding[c] * task.error[c]
    if task.tool_rows:
        w = task.row_scale[3] * task.row_scale[3] / task.yielding[3]
        for c in range(3, 6):
            v[c] = w * task.error[c]


@jit
def spread(chain: Any, settling: Any) -> float:
    """(tr S^4)^(1/4), no less than the largest |eigenvalue| of S and no more than ||S||_F."""
    S, n = settling.S, chain.n
    total = 0.0
    for i in range(n):
        row = S[i]
        for j in range(i):
            other = S[j]
            s = plus_products(0.0, row, other, n)
            total += 2.0 * s * s
        s = plus_products(0.0, row, row, n)
        total += s * s
    return sqrt(sqrt(total))


@jit
def _add_bend_of_rotation(faults: Any, task: Any, J: Any, S: Any) -> None:
    """- L^2 (1 - g)(W'W), W = (1 - uu') J_r, g = (|e|/2) cot(|e|/2): how the rotation vector itself bends."""
    e = three_from(task.error, 3)
    angle = length(e)
    if not angle > STRAIGHT:
        return
    u = (e[0] / angle, e[1] / angle, e[2] / angle)
    half = 0.5 * angle
    w = task.row_scale[3] * task.row_scale[3] / task.yielding[3] * (1.0 - half * cos(half) / sin(half))
    for a in range(faults.working):
        i = faults.order[a]
        turn = column(J, 3, i)
        for b in range(a + 1):
            j = faults.order[b]
            other = column(J, 3, j)
            S[i, j] -= w * (inner(turn, other) - inner(turn, u) * inner(other, u))


@jit
def _add_bend_of_axis(faults: Any, task: Any, kinematics: Any, J: Any, S: Any) -> None:
    """- L^2 ((1 - |e| cot |e|)(d'w)^2 + (a'w)(t'w)), w = J_r: the same of the turn of the tool axis a.

    t = e x a points along the turn with its length, d = t/|t|.
    """
    e = three_from(task.error, 3)
    angle = length(e)
    if not angle > STRAIGHT:
        return
    tool = tool_axis(task, kinematics, 2)
    t = cross(e, tool)
    L2 = task.row_scale[3] * task.row_scale[3] / task.yielding[3]
    sine = sin(angle)
    bend = 1.0 + STEEPEST if sine <= 0.0 else min(1.0 - angle * cos(angle) / sine, 1.0 + STEEPEST)
    bend *= L2 / (angle * angle)
    for i_at in range(faults.working):
        i = faults.order[i_at]
        ti, ai = inner(column(J, 3, i), t), inner(column(J, 3, i), tool)
        for j_at in range(i_at + 1):
            j = faults.order[j_at]
            tj, aj = inner(column(J, 3, j), t), inner(column(J, 3, j), tool)
            S[i, j] -= bend * ti * tj + 0.5 * L2 * (ai * tj + aj * ti)


@jit
def curvature(faults: Any, task: Any, kinematics: Any, chain: Any, settling: Any) -> float:
    """Fill S over the joints that work, zero elsewhere; its Frobenius norm s.

        position   S_ij = - (z_i x p_j) . e_p for i <= j
        rotation   S_ij = - L^2/2 (z_i x z_j) . e_r for i < j, and the bend of the error's own measure

    z_i and p_j are columns of the tip's Jacobian; with joints that mimic others it is E'S E. Rows that the
    task leaves out count as without error.
    Source: docs/theory/settling.md, "The curvature".
    """
    S, J, v = settling.S, columns(kinematics, chain), settling.weighted
    weighted_error(task, settling)
    for i in range(chain.n):
        S[i, : i + 1] = 0.0
    for a in range(faults.working):
        j = faults.order[a]
        # (z_i x p_j) . e = z_i . (p_j x e)
        c, r = cross(column(J, 0, j), three(v)), cross(column(J, 3, j), three_from(v, 3))
        for b in range(a + 1):
            i = faults.order[b]
            s = inner(column(J, 3, i), c)
            if i != j:
                s += 0.5 * inner(column(J, 3, i), r)
            S[j, i] = -s
    if task.uses_rotation:
        if task.tool_rows:
            _add_bend_of_axis(faults, task, kinematics, J, S)
        elif task.m >= 3 and task.rows[task.m - 3] == 3:
            _add_bend_of_rotation(faults, task, J, S)
    if chain.mimics:
        for i in range(chain.n):
            assign(S[:, i], S[i], i)
        fold_square(chain, S, 0.0)
    square = 0.0
    for i in range(chain.n):
        for j in range(i):
            S[j, i] = S[i, j]
            square += 2.0 * S[i, j] * S[i, j]
        square += S[i, i] * S[i, i]
    return sqrt(square)
