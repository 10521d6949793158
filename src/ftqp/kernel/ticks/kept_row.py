"""What a log keeps of a step, in a row of numbers."""

from math import nan
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import (
    FAILED,
    FALLBACK,
    HARD,
    HEALTHY,
    INFEASIBLE,
    RELAXED,
    SOLVED,
    TORQUE_DRIVE,
)
from ftqp.kernel.maths.linear_systems import plus_products
from ftqp.kernel.ticks.arm_states import torques


@jit
def _qp_outcome(task: Any, cascade: Any, code: int) -> int:
    """What the residuals made of the solver's claim, -1 where the tick needed no QP of the task."""
    claim, fell_back = cascade.claim, code == FALLBACK
    missed = code == RELAXED and task.mode == HARD and cascade.missed != 0
    if (claim == SOLVED and (fell_back or missed)) or (claim == INFEASIBLE and fell_back):
        return FAILED
    return int(claim)


@jit
def _keep_torques(K: Any, row: Any, at: int) -> None:
    """Torques of the motors and of the brakes, from ``at`` on; NaN without inertia."""
    n, known = K.chain.n, K.chain.has_inertia != 0
    if known and not K.kinematics.has_dynamics:
        torques(K)
    tau = K.feedback.tau_sent if K.feedback.kind == TORQUE_DRIVE else K.state.tau
    for i in range(n):
        row[at + i] = tau[i] if known or K.feedback.kind == TORQUE_DRIVE else nan
        row[at + n + i] = K.state.tau_brake[i] if known else nan


@jit
def _keep_jacobian(K: Any, row: Any, at: int) -> None:
    """The task's rows in characteristic lengths, (6, n), zero for joints that do not work."""
    n, m, A = K.chain.n, K.task.m, K.qp.A
    for k in range(6):
        for i in range(n):
            x = 0.0
            if k < m and K.faults.code[i] == HEALTHY:
                x = A[k, i]
                if K.turned.on:
                    x = plus_products(0.0, K.turned.U[k], A[:, i], m)
            row[at + k * n + i] = x / K.task.length


@jit
def keep_step(K: Any, rows: Any, first: int, rest: int, k: int, code: int) -> None:
    """Write the last step, which ended as ``code``, into row k.

    From ``first`` on a, tau, tau_brake, lower and upper, n each; from ``rest`` on slack (6), jacobian (6 n),
    position_error, rotation_error, scale, status, qp_status, qp_iterations, qp_residual, a place that is left
    as it is, and kappa.
    """
    row, task, qp, cascade, n = rows[k], K.task, K.qp, K.cascade, K.chain.n
    for i in range(n):
        row[first + i] = K.state.a_command[i]
        row[first + 3 * n + i], row[first + 4 * n + i] = qp.lb[i], qp.ub[i]
    _keep_torques(K, row, first + n)
    for r in range(6):
        row[rest + r] = task.slack[r] / task.row_scale[task.rows[r]] if r < task.m else 0.0
    _keep_jacobian(K, row, rest + 6)
    at = rest + 6 + 6 * n
    row[at], row[at + 1], row[at + 2] = task.position_error, task.rotation_error, task.scale
    row[at + 3], row[at + 4], row[at + 5] = code, _qp_outcome(task, cascade, code), cascade.qp_iterations
    row[at + 6] = max(cascade.residual_task, cascade.residual_bounds, cascade.residual_dual)
    row[at + 8] = cascade.kappa
