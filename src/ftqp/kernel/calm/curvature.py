"""The exact curvature of the task's error: M = A'A + S is the Hessian of E = e'e/2 over the joints."""

from math import cos, sin, sqrt
from typing import Any

from ftqp.kernel.arm.kinematics import columns, fold_square
from ftqp.kernel.jit import jit
from ftqp.kernel.maths.elementary import cross
from ftqp.kernel.rows.task_rows import component_of

STRAIGHT = 1e-4
"""A rotation error below this [rad] has no curvature of its own. That is left out because it is |e|^2/3 of
the plain one at most, 3e-9."""
STEEPEST = 3.0
"""Most that the curvature of an axis error counts across its own direction, as a multiple of the plain one;
at a half turn it is endless."""


@jit
def weigh_rows(task: Any, kinematics: Any, chain: Any, qp: Any, calm: Any) -> float:
    """Rows and error of the task as its priority weighs them, times 1/sqrt(yielding); e'e.

    It needs ``task_rows``, whose A it reads.
    """
    n = chain.n
    square = 0.0
    for k in range(task.m):
        c = task.rows[k]
        w = 1.0 / sqrt(task.yielding[c])
        for i in range(n):
            calm.A[k, i] = w * qp.A[k, i]
        e = w * task.row_scale[c] * component_of(task, kinematics, c, 0, task.error)
        calm.e[k] = e
        square += e * e
    return square


@jit
def weighted_error(task: Any, calm: Any) -> None:
    """The error vector along W with only the rows of the task, weighted twice: what S is linear in."""
    v = calm.weighted
    for c in range(6):
        v[c] = 0.0
    for k in range(task.m):
        c = task.rows[k]
        if c < 3 or not task.tool_rows:
            v[c] = task.row_scale[c] * task.row_scale[c] / task.yielding[c] * task.error[c]
    if task.tool_rows:
        w = task.row_scale[3] * task.row_scale[3] / task.yielding[3]
        for c in range(3, 6):
            v[c] = w * task.error[c]


@jit
def spread(chain: Any, calm: Any) -> float:
    """(tr S^4)^(1/4), no less than the largest |eigenvalue| of S and no more than ||S||_F."""
    S, n = calm.S, chain.n
    total = 0.0
    for i in range(n):
        row = S[i]
        for j in range(i):
            other = S[j]
            s = 0.0
            for k in range(n):
                s += row[k] * other[k]
            total += 2.0 * s * s
        s = 0.0
        for k in range(n):
            s += row[k] * row[k]
        total += s * s
    return sqrt(sqrt(total))


@jit
def _add_bend_of_rotation(faults: Any, task: Any, J: Any, S: Any) -> None:
    """- L^2 (1 - g)(W'W), W = (1 - uu') J_r, g = (|e|/2) cot(|e|/2): how the rotation vector itself bends."""
    x, y, z = task.error[3], task.error[4], task.error[5]
    angle = sqrt(x * x + y * y + z * z)
    if not angle > STRAIGHT:
        return
    x, y, z = x / angle, y / angle, z / angle
    half = 0.5 * angle
    w = task.row_scale[3] * task.row_scale[3] / task.yielding[3] * (1.0 - half * cos(half) / sin(half))
    for a in range(faults.working):
        i = faults.order[a]
        along = J[3, i] * x + J[4, i] * y + J[5, i] * z
        for b in range(a + 1):
            j = faults.order[b]
            s = J[3, i] * J[3, j] + J[4, i] * J[4, j] + J[5, i] * J[5, j]
            s -= along * (J[3, j] * x + J[4, j] * y + J[5, j] * z)
            S[i, j] -= w * s


@jit
def _add_bend_of_axis(faults: Any, task: Any, kinematics: Any, J: Any, S: Any) -> None:
    """- L^2 ((1 - |e| cot |e|)(d'w)^2 + (a'w)(t'w)), w = J_r: the same of the turn of the tool axis a.

    t = e x a points along the turn with its length, d = t/|t|.
    """
    R, axis = kinematics.R_tip, task.axis
    x, y, z = task.error[3], task.error[4], task.error[5]
    angle = sqrt(x * x + y * y + z * z)
    if not angle > STRAIGHT:
        return
    a0 = R[0] * axis[2] + R[1] * axis[5] + R[2] * axis[8]
    a1 = R[3] * axis[2] + R[4] * axis[5] + R[5] * axis[8]
    a2 = R[6] * axis[2] + R[7] * axis[5] + R[8] * axis[8]
    t0, t1, t2 = y * a2 - z * a1, z * a0 - x * a2, x * a1 - y * a0
    L2 = task.row_scale[3] * task.row_scale[3] / task.yielding[3]
    sine = sin(angle)
    bend = 1.0 + STEEPEST if sine <= 0.0 else min(1.0 - angle * cos(angle) / sine, 1.0 + STEEPEST)
    bend *= L2 / (angle * angle)
    for i_at in range(faults.working):
        i = faults.order[i_at]
        ti = J[3, i] * t0 + J[4, i] * t1 + J[5, i] * t2
        ai = J[3, i] * a0 + J[4, i] * a1 + J[5, i] * a2
        for j_at in range(i_at + 1):
            j = faults.order[j_at]
            tj = J[3, j] * t0 + J[4, j] * t1 + J[5, j] * t2
            aj = J[3, j] * a0 + J[4, j] * a1 + J[5, j] * a2
            S[i, j] -= bend * ti * tj + 0.5 * L2 * (ai * tj + aj * ti)


@jit
def curvature(faults: Any, task: Any, kinematics: Any, chain: Any, calm: Any) -> float:
    """Fill S over the joints that work, zero elsewhere; its Frobenius norm s.

        position   S_ij = - (z_i x p_j) . e_p for i <= j
        rotation   S_ij = - L^2/2 (z_i x z_j) . e_r for i < j, and the bend of the error's own measure

    z_i and p_j are columns of the tip's Jacobian; with joints that mimic others it is E'S E. Rows that the
    task leaves out count as without error.
    Source: docs/theory/calm.md, "The curvature".
    """
    S, J, v = calm.S, columns(kinematics, chain), calm.weighted
    weighted_error(task, calm)
    for i in range(chain.n):
        for j in range(i + 1):
            S[i, j] = 0.0
    for a in range(faults.working):
        j = faults.order[a]
        # (z_i x p_j) . e = z_i . (p_j x e)
        c0, c1, c2 = cross(J[0, j], J[1, j], J[2, j], v[0], v[1], v[2])
        r0, r1, r2 = cross(J[3, j], J[4, j], J[5, j], v[3], v[4], v[5])
        for b in range(a + 1):
            i = faults.order[b]
            s = J[3, i] * c0 + J[4, i] * c1 + J[5, i] * c2
            if i != j:
                s += 0.5 * (J[3, i] * r0 + J[4, i] * r1 + J[5, i] * r2)
            S[j, i] = -s
    if task.uses_rotation:
        if task.tool_rows:
            _add_bend_of_axis(faults, task, kinematics, J, S)
        elif task.m >= 3 and task.rows[task.m - 3] == 3:
            _add_bend_of_rotation(faults, task, J, S)
    if chain.mimics:
        for i in range(chain.n):
            for j in range(i):
                S[j, i] = S[i, j]
        fold_square(chain, S, 0.0)
    square = 0.0
    for i in range(chain.n):
        for j in range(i):
            S[j, i] = S[i, j]
            square += 2.0 * S[i, j] * S[i, j]
        square += S[i, i] * S[i, i]
    return sqrt(square)
