"""The task as equality rows A x = b: which rows of the pose, in which units, with which feedback."""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import (
    ACCELERATION,
    SCALE,
    TARGET_ACCELERATION,
    TARGET_TWIST,
)
from ftqp.kernel.rows.path_rows import path_row

TIP_BRAKE_STEPS = 20.0
"""Scaled mode: scale 0 brakes the tip along its own direction with the time constant TIP_BRAKE_STEPS dt."""
SCALE_WEIGHT = 1e3
"""Scaled mode: 1 - scale costs SCALE_WEIGHT times the largest value of the objective."""


@jit
def _row_of(K: Any, component: int, offset: int, source: Any) -> float:
    """Component 0..5 of a six-vector along W; with tool rows the angular part along the tool's axes."""
    if component < 3 or not K.tool_rows:
        value: float = source[offset + component]
        return value
    c = component - 3
    total = 0.0
    for r in range(3):  # (R_tip R_axis)' w
        t = (
            K.R_tip[3 * r] * K.axis[c]
            + K.R_tip[3 * r + 1] * K.axis[3 + c]
            + K.R_tip[3 * r + 2] * K.axis[6 + c]
        )
        total += t * source[offset + 3 + r]
    return total


@jit
def task_rows(K: Any) -> None:
    """Acceleration level: A = J, b = r'' - Jdot v + kv (r' - J v) + kp e.  Velocity level: b = r' + kp e.

    Angular rows are multiplied by the characteristic length, so that every row counts in metres. Scaled mode
    adds the
    path scale s as a variable: A x - s (b - b_0) = b_0, where s = 0 brakes the tip (velocity level: b_0 = 0).
    Source: Jin et al. 2017; scaling as in Flacco et al., ICRA 2012.
    """
    n, m = K.n, K.m
    for k in range(m):
        c = K.rows[k]
        w = K.row_scale[c]
        row = K.A[k]
        if c < 3 or not K.tool_rows:
            J = K.J[c]
            for i in range(n):
                row[i] = w * J[i]
        else:
            a = c - 3
            t0 = K.R_tip[0] * K.axis[a] + K.R_tip[1] * K.axis[3 + a] + K.R_tip[2] * K.axis[6 + a]
            t1 = K.R_tip[3] * K.axis[a] + K.R_tip[4] * K.axis[3 + a] + K.R_tip[5] * K.axis[6 + a]
            t2 = K.R_tip[6] * K.axis[a] + K.R_tip[7] * K.axis[3 + a] + K.R_tip[8] * K.axis[6 + a]
            for i in range(n):
                row[i] = w * (t0 * K.J[3, i] + t1 * K.J[4, i] + t2 * K.J[5, i])
        e = w * _row_of(K, c, 0, K.error)
        rate = w * _row_of(K, c, TARGET_TWIST, K.target)
        moving = drift = 0.0
        if K.level == ACCELERATION:
            for i in range(n):
                moving += row[i] * K.v[i]
            drift = w * _row_of(K, c, 0, K.drift)
            b = w * _row_of(K, c, TARGET_ACCELERATION, K.target) + K.kv * (rate - moving) + K.kp * e - drift
            rest = -drift - moving / (TIP_BRAKE_STEPS * K.dt)
        else:
            b = rate + K.kp * e
            rest = 0.0
        K.b[k] = b
        if K.mode == SCALE:
            row[n] = rest - b
            K.b[k] = rest
            if K.on_path:
                change = w * _row_of(K, c, TARGET_ACCELERATION, K.target)
                drift = w * _row_of(K, c, 0, K.drift)
                path_row(K, k, rate, change, moving, e, drift)
    K.meq = m
    K.nx = n


@jit
def compliance(K: Any, ratio: float) -> None:
    """soft_k = yielding_k ratio |A|_F^2 / (m tr H): the slack's weight follows the QP's own magnitude.

    Rows turned by directional damping have no priority of their own; their damping adds.
    """
    trace = 0.0
    for i in range(K.n):
        trace += K.H[i, i] if K.dense else K.H_diagonal[i]
    norm = 0.0
    for k in range(K.meq):
        for i in range(K.n):
            norm += K.A[k, i] * K.A[k, i]
    soft = ratio * norm / (max(K.meq, 1) * trace) + 1e-300
    for k in range(K.meq):
        K.soft[k] = soft + K.damp[k] * K.n / trace if K.turned else soft * K.yielding[K.rows[k]]


@jit
def path_scale(K: Any) -> None:
    """The extra variable s in [0, 1] of the scaled mode, drawn to 1."""
    n = K.n
    size = 0.0
    for i in range(n):
        reach = min(K.a_max[i], 1e3) if K.level == ACCELERATION else min(K.v_max[i], 1e3)
        size += (K.H[i, i] if K.dense else K.H_diagonal[i]) * reach * reach
    weight = SCALE_WEIGHT * size
    for i in range(n):
        K.H[i, n] = K.H[n, i] = 0.0
    K.H[n, n] = K.H_diagonal[n] = weight
    K.g[n] = -weight
    K.lb[n], K.ub[n] = 0.0, 1.0
    K.nx = n + 1


@jit
def error_norms(K: Any) -> None:
    """Position error [m] and rotation error [rad] over the rows of the task."""
    linear = angular = 0.0
    for k in range(K.m):
        e = _row_of(K, K.rows[k], 0, K.error)
        if K.rows[k] < 3:
            linear += e * e
        else:
            angular += e * e
    K.position_error = sqrt(linear)
    K.rotation_error = sqrt(angular)
