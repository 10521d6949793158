"""Directional damping: near a singularity the task gives way along the singular directions alone."""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import HEALTHY
from ftqp.kernel.maths.singular_directions import singular_directions
from ftqp.kernel.rows.path_rows import SINGULAR_FROM

CALM_FROM = 0.1
"""Singular value below which the task fades where a path is blocked; elsewhere SINGULAR_FROM."""
PATIENT_WITH = 2e-3
"""Error in characteristic lengths, along directions where the feedback has faded, at which a path waits."""


@jit
def _reduced_svd(K: Any) -> None:
    """turn and sigma of the task rows' columns of the healthy joints."""
    W, columns = K.V, 0  # V is the solver's memory, free until it runs
    for i in range(K.n):
        if K.fault[i] == HEALTHY:
            for k in range(K.m):
                W[k, columns] = K.A[k, i]
            columns += 1
    singular_directions(W, K.m, columns, K.turn, K.sigma)


@jit
def fade_feedback(K: Any) -> None:
    """Where a path is blocked, the task loses the share 1 - (sigma_k/sigma_0)^2 along singular directions.

    A path that waits at a singularity leaves an error that no motion reduces, and the full feedback would
    swing
    the arm at its acceleration limits from one side of the singularity to the other. Until the verdict that
    is
    welcome: it finds ways that slow motions do not. But then the path goes on no faster than the share of
    PATIENT_WITH lengths that the error along these directions leaves, so that no swing carries it off. The
    velocity feedback of the acceleration level stays whole.
    """
    m, U = K.m, K.turn
    _reduced_svd(K)
    lost, blocked = 0.0, K.rate_limit == 0.0
    for k in range(m):
        share = K.sigma[k] / (K.length * (CALM_FROM if blocked else SINGULAR_FROM))
        if share < 1.0:
            along = 0.0
            for j in range(m):
                along += U[j, k] * K.feedback[j]
            along *= 1.0 - share * share
            lost += along * along
            if blocked:
                for j in range(m):
                    K.b[j] -= along * U[j, k]
    K.rate_left = 1.0
    if lost > 0.0 and not blocked:
        K.rate_left = max(0.0, 1.0 - sqrt(lost) / (K.kp * K.length * PATIENT_WITH))


@jit
def turn_rows(K: Any) -> None:
    """U'A x + s = U'b, U of the reduced Jacobian A_f = U diag(sigma) V' of the healthy joints.

    Row k below the threshold gets the compliance damp_k = (length factor (1 - (sigma_k/(length
    sigma_0))^2))^2,
    in units of H, above it none. With H = I and no bound in the way that is
    x = sum_k sigma_k/(sigma_k^2 + damp_k) v_k u_k'b: each singular direction damped by itself, the others
    followed exactly.
    Source: variable damping of Nakamura & Hanafusa 1986 and numerical filtering of Maciejewski & Klein 1988,
    here as compliance of turned rows, so that bounds, torque rows and objective stay those of the QP.
    """
    n, m = K.n, K.m
    U = K.turn
    _reduced_svd(K)
    for i in range(n):
        for k in range(m):
            s = 0.0
            for j in range(m):
                s += U[j, k] * K.A[j, i]
            K.t[k] = s
        for k in range(m):
            K.A[k, i] = K.t[k]
    for k in range(m):
        s = 0.0
        for j in range(m):
            s += U[j, k] * K.b[j]
        K.t[k] = s
    for k in range(m):
        K.b[k] = K.t[k]
        share = K.sigma[k] / (K.length * K.damping_threshold)
        rest = 1.0 - share * share
        K.damp[k] = (K.length * K.damping_factor * rest) ** 2 if share < 1.0 else 0.0
    K.turned = 1


@jit
def turn_back(K: Any) -> None:
    """The slack along the rows of the task, from that along the singular directions."""
    m = K.m
    for k in range(m):
        s = 0.0
        for j in range(m):
            s += K.turn[k, j] * K.slack[j]
        K.t[k] = s
    for k in range(m):
        K.slack[k] = K.t[k]
