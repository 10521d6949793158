"""Error and Jacobian of a study's task rows, and their derivatives."""

from math import cos, sin, sqrt
from typing import Any

from ftqp.kernel.arm.kinematics import forward_kinematics
from ftqp.kernel.arm.pose_error import tool_turn, turn_between
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.maths.linear_systems import assign, plus_products
from ftqp.kernel.maths.svd import singular_directions
from ftqp.kernel.maths.vectors import Vector, column, cross, inner, plus, three_from, times

SMALL = 1e-3
"""Angle [rad] below which the inverse right Jacobian is a series. The series is then cut below rounding: its
next term is of the fourth power."""


@part_jit
def task_values(S: Any) -> float:
    """e = (p_d - p; length rotvec(R_d R')) and A = dx/dq of the study's rows at ``state.q``; returns |e|."""
    forward_kinematics(S, S.state)
    kinematics, study = S.kinematics, S.study
    T, R, full, J = study.goal, kinematics.R_tip, study.full, kinematics.J
    for r in range(3):
        full[r] = T[4 * r + 3] - kinematics.o_tip[r]
    if study.axis:
        full[3], full[4], full[5] = tool_turn(R, T)
    elif study.turns:
        full[3], full[4], full[5] = turn_between(T, 4, R, 3)
    square = 0.0
    for row in range(study.m):
        k = study.rows[row]
        scale = study.length if k > 2 else 1.0
        study.e[row] = scale * full[k]
        square += study.e[row] * study.e[row]
        for i in range(S.chain.n):
            study.A[row, i] = 0.0 if study.held[i] else scale * J[k, i]
        if study.axis and k > 2:
            for i in range(S.chain.n):
                along = T[k - 3] * J[3, i] + T[k + 1] * J[4, i] + T[k + 5] * J[5, i]
                study.A[row, i] = 0.0 if study.held[i] else scale * along
    return sqrt(square)


@jit
def _shrinking(S: Any, w: Vector) -> Vector:
    """J_r^-1(phi) w: how fast the rotation vector phi of R_d R' shrinks while the tip turns with w.

    J_r^-1 = 1 + [phi]/2 + (1/a^2 - (1 + cos a)/(2 a sin a)) [phi]^2, a = |phi|.
    Source: docs/theory/unidentified-failures.md.
    """
    p = three_from(S.study.full, 3)
    square = inner(p, p)
    angle = sqrt(square)
    c = 1.0 / 12.0 + square / 720.0
    if angle > SMALL:
        c = 1.0 / square - (1.0 + cos(angle)) / (2.0 * angle * sin(angle))
    a = cross(p, w)
    return plus(plus(w, times(0.5, a)), times(c, cross(p, a)))


@jit
def error_rates(S: Any, D: Any) -> None:
    """D = -de/dq, (m, n), at the values of ``task_values``: A where no rotation is left, exact everywhere."""
    study, J = S.study, S.kinematics.J
    for i in range(S.chain.n):
        r0, r1, r2 = _shrinking(S, column(J, 3, i)) if study.turns else column(J, 3, i)
        for row in range(study.m):
            k = study.rows[row]
            rate = J[k, i] if k < 3 else study.length * (r0 if k == 3 else r1 if k == 4 else r2)
            D[row, i] = 0.0 if study.held[i] else rate


@jit
def jacobian_rates(S: Any, H: Any) -> None:
    """H[l, :, k] = dA_k/dq_l, (n, m, n), at the values of ``task_values``, held joints as if they moved.

    Linear rows: w_min x j_max, min and max of k and l, w_i the axis of a joint that turns, 0 of one that
    slides; angular rows: w_l x w_k for l < k, else 0. Source: docs/theory/unidentified-failures.md.
    """
    study, J = S.study, S.kinematics.J
    n = S.chain.n
    for l in range(n):
        for k in range(n):
            low, high = min(k, l), max(k, l)
            d0, d1, d2 = cross(column(J, 3, low), column(J, 0, high))
            r0, r1, r2 = cross(column(J, 3, l), column(J, 3, k))
            for row in range(study.m):
                j = study.rows[row]
                if j < 3:
                    H[l, row, k] = d0 if j == 0 else d1 if j == 1 else d2
                else:
                    rate = r0 if j == 3 else r1 if j == 4 else r2
                    H[l, row, k] = study.length * rate if l < k else 0.0


CUT_OFF = 1e-12
"""A singular value below this share of the largest counts as zero. Rounding of an SVD, some thousand
times."""


@part_jit
def decompose(S: Any) -> None:
    """A = U diag(sigma) V' into ``U``, ``sigma`` and ``W`` = diag(sigma) V'."""
    study = S.study
    for row in range(study.m):
        assign(study.W[row], study.A[row], S.chain.n)
    singular_directions(study.W, study.m, S.chain.n, study.U, study.sigma)


@jit
def least_step(S: Any, damping: float) -> float:
    """dq = V diag(sigma/(sigma^2 + damping)) U' e into ``dq``; returns its largest entry.

    Without damping it is the least-norm solution of A dq = e.
    """
    study, n = S.study, S.chain.n
    study.dq[:n] = 0.0
    for k in range(study.m):
        s = study.sigma[k]
        if s <= CUT_OFF * study.sigma[0]:
            continue
        along = plus_products(0.0, study.U[:, k], study.e, study.m)
        along /= s * s + damping
        for i in range(n):
            study.dq[i] += along * study.W[k, i]
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(study.dq[i]))
    return largest


@jit
def onto_null_space(S: Any, t: Any) -> float:
    """t <- (1 - V V') t, then of length 1; returns the length that was left of it."""
    study, n = S.study, S.chain.n
    for k in range(study.m):
        s = study.sigma[k]
        if s <= CUT_OFF * study.sigma[0]:
            continue
        along = plus_products(0.0, study.W[k], t, n)
        along /= s * s
        for i in range(n):
            t[i] -= along * study.W[k, i]
    square = plus_products(0.0, t, t, n)
    size = sqrt(square)
    if size > 0.0:
        for i in range(n):
            t[i] /= size
    return size


@jit
def any_null_direction(S: Any, t: Any) -> None:
    """t <- the direction of self-motion that leaves most of a joint's own direction."""
    n = S.chain.n
    best, which = -1.0, 0
    for j in range(n):
        if S.study.held[j]:
            continue
        for i in range(n):
            t[i] = 1.0 if i == j else 0.0
        left = onto_null_space(S, t)
        if left > best:
            best, which = left, j
    for i in range(n):
        t[i] = 1.0 if i == which else 0.0
    onto_null_space(S, t)
    onto_null_space(S, t)
