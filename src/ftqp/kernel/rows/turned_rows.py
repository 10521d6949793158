"""Directional damping: near a singularity the task gives way along the singular directions alone."""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.thresholds import SINGULAR_FROM
from ftqp.kernel.maths.singular_directions import singular_directions

CALM_FROM = 0.1
"""Singular value below which the task fades where a path is blocked; elsewhere SINGULAR_FROM."""
PATIENT_WITH = 2e-3
"""Error in characteristic lengths, along directions where the feedback has faded, at which a path waits."""


@jit
def _reduced_svd(faults: Any, task: Any, qp: Any, scratch: Any, turned: Any) -> None:
    """U and sigma of the task rows' columns of the working joints; diag(sigma) V' stays in scratch."""
    W = scratch.wide
    for column in range(faults.working):
        for k in range(task.m):
            W[k, column] = qp.A[k, faults.order[column]]
    singular_directions(W, task.m, faults.working, turned.U, turned.sigma)


@jit
def fade_feedback(K: Any, path: Any) -> None:
    """Where a path is blocked without calm, the task loses 1 - (sigma_k/sigma_0)^2 along singular directions.

    A path that waits at a singularity leaves an error that no motion reduces, and the full feedback would
    swing the arm at its acceleration limits from one side of the singularity to the other. Calm brakes that;
    without it the arm may swing until the verdict. With calm and without, the path goes on no faster than the
    share of PATIENT_WITH lengths that the error along these directions leaves, so that no swing carries it
    off. The velocity feedback of the acceleration level stays whole.
    """
    task, turned, qp = K.task, K.turned, K.qp
    m, U = task.m, turned.U
    _reduced_svd(K.faults, task, qp, K.scratch, turned)
    lost, blocked = 0.0, path.limit == 0.0 and not K.calm.on
    for k in range(m):
        share = turned.sigma[k] / (task.length * (CALM_FROM if blocked else SINGULAR_FROM))
        if share < 1.0:
            along = 0.0
            for j in range(m):
                along += U[j, k] * path.feedback[j]
            along *= 1.0 - share * share
            lost += along * along
            if blocked:
                for j in range(m):
                    qp.b[j] -= along * U[j, k]
    path.left = 1.0
    if lost > 0.0 and not blocked:
        path.left = max(0.0, 1.0 - sqrt(lost) / (task.kp * task.length * PATIENT_WITH))


@part_jit
def turn_rows(K: Any) -> None:
    """U'A x + s = U'b, U of the reduced Jacobian A_f = U diag(sigma) V' of the working joints.

    Row k below the threshold sigma_0 gets the compliance

        softness_k = (length factor (1 - (sigma_k/(length sigma_0))^2))^2

    in units of H, a row above it none. With H = I and no bound in the way the solution is
    x = sum_k sigma_k/(sigma_k^2 + softness_k) v_k u_k'b: each singular direction is damped by itself, and the
    others are followed exactly.
    Source: variable damping of Nakamura and Hanafusa 1986 and numerical filtering of Maciejewski and Klein
    1988, here as compliance of turned rows, so that bounds, torque rows and objective stay those of the QP;
    docs/theory/singularities.md, "Directional damping".
    """
    chain, task, turned, qp, scratch = K.chain, K.task, K.turned, K.qp, K.scratch
    n, m = chain.n, task.m
    U = turned.U
    _reduced_svd(K.faults, task, qp, scratch, turned)
    for i in range(n):
        for k in range(m):
            s = 0.0
            for j in range(m):
                s += U[j, k] * qp.A[j, i]
            scratch.rows[k] = s
        for k in range(m):
            qp.A[k, i] = scratch.rows[k]
    for k in range(m):
        s = 0.0
        for j in range(m):
            s += U[j, k] * qp.b[j]
        scratch.rows[k] = s
    for k in range(m):
        qp.b[k] = scratch.rows[k]
        share = turned.sigma[k] / (task.length * turned.threshold)
        rest = 1.0 - share * share
        turned.softness[k] = (task.length * turned.factor * rest) ** 2 if share < 1.0 else 0.0
    turned.on = 1


@jit
def turn_back(task: Any, scratch: Any, turned: Any) -> None:
    """The slack along the rows of the task, from that along the singular directions."""
    m = task.m
    for k in range(m):
        s = 0.0
        for j in range(m):
            s += turned.U[k, j] * task.slack[j]
        scratch.rows[k] = s
    for k in range(m):
        task.slack[k] = scratch.rows[k]
