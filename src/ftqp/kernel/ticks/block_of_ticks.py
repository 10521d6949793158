"""Blocks of ticks in closed loop on an arm that follows exactly, with a row of numbers kept of each."""

from typing import Any

import numpy as np

from ftqp.kernel.arm.kinematics import motion
from ftqp.kernel.jit import jit, nanoseconds, tick_of
from ftqp.kernel.judge.solution_check import torques_without_inertia
from ftqp.kernel.layout.enums import FAILED, FALLBACK, HARD, INFEASIBLE, RELAXED, SOLVED, VELOCITY


@jit
def qp_outcome(task: Any, cascade: Any) -> int:
    """What the residuals made of the solver's claim, -1 when the tick needed no task QP."""
    claim, status = cascade.claim, cascade.status
    if claim == INFEASIBLE and status == FALLBACK:
        return FAILED
    hard_missed = status == RELAXED and task.mode == HARD and cascade.missed
    if claim == SOLVED and (status == FALLBACK or hard_missed):
        return FAILED
    return int(claim)


@jit
def complete_torques(K: Any, has_inertia: int) -> None:
    """The torques of the command, also where the tick did without them; NaN without inertia."""
    if has_inertia:
        if not K.kinematics.has_dynamics:
            if K.state.level == VELOCITY:
                motion(K, K.state)
            torques_without_inertia(K)
    else:
        for i in range(K.chain.n):
            K.state.tau[i] = K.state.tau_brake[i] = np.nan


@jit
def keep(K: Any, places: Any, row: Any) -> None:
    """Write the tick into a row, each field at its place; see ``ftqp.kernel.layout.flat_arrays``."""
    state, task, qp, cascade, kinematics = K.state, K.task, K.qp, K.cascade, K.kinematics
    n = K.chain.n
    q, v, a, tau, brake, lower, upper, tip, slack, jacobian, rest = places
    for i in range(n):
        row[q + i], row[v + i] = state.given_q[i], state.given_v[i]
        row[a + i] = state.a_command[i]
        row[tau + i], row[brake + i] = state.tau[i], state.tau_brake[i]
        row[lower + i], row[upper + i] = qp.lb[i], qp.ub[i]
    for r in range(3):
        for c in range(3):
            row[tip + 4 * r + c] = kinematics.R_tip[3 * r + c]
        row[tip + 4 * r + 3] = kinematics.o_tip[r]
    for k in range(6):
        row[slack + k] = task.slack[k] / task.row_scale[task.rows[k]] if k < task.m else 0.0
        for i in range(n):
            row[jacobian + k * n + i] = 0.0
        if k < task.m:
            for c in range(K.faults.working):
                i = K.faults.order[c]
                row[jacobian + k * n + i] = qp.A[k, i] / task.length
    row[rest] = task.position_error
    row[rest + 1] = task.rotation_error
    row[rest + 2] = task.scale
    row[rest + 3] = cascade.status
    row[rest + 4] = qp_outcome(task, cascade)
    row[rest + 5] = cascade.qp_iterations
    row[rest + 6] = max(cascade.residual_task, cascade.residual_bounds, cascade.residual_dual)
    row[rest + 8] = cascade.kappa


@jit
def block(
    K: Any, tick: Any, q: Any, v: Any, targets: Any, state: Any, first: int, has_inertia: int, rows: Any,
    place: Any,
) -> int:  # fmt: skip
    """How many ticks were done; fewer than there are rows when the tick raised or the inputs were mistaken.

    q and v are arrays on the memory of ``state``, (2 n,), which holds the next state on return. The tick
    takes them and row ``first + k`` of ``targets``. Row k of the rows gets the k-th tick.
    """
    n = K.chain.n
    places = (
        place[0], place[1], place[2], place[3], place[4], place[5], place[6], place[7], place[8],
        place[9], place[10],
    )  # fmt: skip
    for k in range(len(rows)):
        begin = nanoseconds()
        code = tick_of(tick, q, v, targets, first + k)
        elapsed = nanoseconds() - begin
        if code < 0:
            return k
        complete_torques(K, has_inertia)
        keep(K, places, rows[k])
        rows[k, places[10] + 7] = elapsed
        for i in range(n):
            state[i], state[n + i] = K.feedback.q_sent[i], K.feedback.v_sent[i]
    return len(rows)
