"""Whole ticks: what takes their inputs, who solves their QP, and what is done at their end.

``ftqp.kernel.entry.table`` puts them together, every leader with every solver. Each returns a status, or a
mistake (negative). Steps for programs in C come last, with the ticks that a late loop has missed.
"""

from typing import Any

import numpy as np

from ftqp.kernel.closed_forms.closed_form_tick import resolve
from ftqp.kernel.commands.believed import falls
from ftqp.kernel.commands.stops import stop
from ftqp.kernel.dtrnn.iterations import solve_planner_qp
from ftqp.kernel.feedback.late_loop import miss
from ftqp.kernel.free.end_stop import stop_torques
from ftqp.kernel.jit import carray, jit, part_jit, pointer
from ftqp.kernel.judge.fallback_cascade import run_cascade
from ftqp.kernel.judge.solution_check import pack, packed_size, solution_size, unpack
from ftqp.kernel.layout.enums import (
    ALL_USABLE,
    ANSWERED,
    GOING_RESTLESS,
    HEALTHY,
    MAIN_STAGE,
    NEWS,
    OK,
    QP_READY,
    RELAXED,
    SLACK,
    SOLVED,
    STOPPED_AS_ASKED,
    TARGET_SIZE,
)
from ftqp.kernel.layout.flat_arrays import VALID
from ftqp.kernel.layout.thresholds import MOST_TICKS, RELAXED_FROM, TASK_FLOOR
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.rows.inertial_target import base_verdict
from ftqp.kernel.rows.path_rows import advance, look_up
from ftqp.kernel.rows.task_rows import turn_back
from ftqp.kernel.search.on_the_way import follow_going, lead_going
from ftqp.kernel.ticks.accepted_inputs import accept_arrays, accept_numbers, accept_state, accept_target
from ftqp.kernel.ticks.tick import (
    prepare,
    prepare_free,
    prepare_on_base,
    prepare_on_joints,
    prepare_on_path,
)

FLOAT = np.dtype(np.float64)

__all__ = ["prepare", "prepare_free", "prepare_on_base", "prepare_on_path", "resolve"]


@part_jit
def accept(K: Any, q: Any, v: Any, target: Any, row: int) -> int:
    """Copy the inputs of a tick: 0, or a mistake."""
    nq = accept_arrays(K.state, K.gate, K.chain, q, v)
    if nq < 0:
        return nq
    code = accept_target(K.task, target, row)
    if code < 0:
        return code
    accept_state(K.state, K.chain, nq)
    return 0


@part_jit
def accept_on_path(K: Any, path: Any, table: Any, q: Any, v: Any) -> int:
    """Copy the state, and look up the path's target at its progress: 0, or a mistake."""
    nq = accept_arrays(K.state, K.gate, K.chain, q, v)
    if nq < 0:
        return nq
    look_up(path, table, len(table), path.target)
    assign(K.task.target, path.target, TARGET_SIZE)
    accept_state(K.state, K.chain, nq)
    return 0


@jit
def accept_on_joints(state: Any, task: Any, gate: Any, chain: Any, q: Any, v: Any) -> int:
    """Copy the state, which is all that a motion of the joints is given: 0, or a mistake."""
    nq = accept_arrays(state, gate, chain, q, v)
    if nq < 0:
        return nq
    task.target[:TARGET_SIZE] = 0.0
    accept_state(state, chain, nq)
    return 0


@jit
def settle(K: Any, code: int) -> int:
    """After a tick led by the clock: the slack along the task's rows."""
    if code != QP_READY and K.turned.on:
        turn_back(K.task, K.scratch, K.turned)
    return code


@jit
def settle_beside_free(K: Any, code: int) -> int:
    """The same beside a free-swinging joint, and the torque of its end stop."""
    settle(K, code)
    stop_torques(K.state, K.faults, K.kinematics, K.chain, K.free)
    return code


@jit
def settle_on_path(K: Any, path: Any, code: int) -> int:
    """After a tick led by the progress along a path, which goes on."""
    if code != QP_READY:
        advance(K.state, K.task, K.kinematics, K.chain, K.qp, path)
    return code


@jit
def settle_on_base(K: Any, base: Any, code: int) -> int:
    """After a tick above a moving base: the slack along the task's rows, the set point, and the verdict."""
    if code != QP_READY:
        settle(K, code)
        base.code = base_verdict(K, base)
    return code


@jit
def hand_over(K: Any, prepared: int, flat_at: int) -> int:
    """The QP into memory when it waits for a solver: QP_READY, or the status of a tick that needed none."""
    code = run_cascade(K, prepared, SOLVED)
    if code == QP_READY:
        flat = carray(pointer(flat_at), (packed_size(K.task, K.cascade, K.chain),), FLOAT)
        pack(K.task, K.cascade, K.chain, K.qp, flat)
    return code


@jit
def take_back(K: Any, solution_at: int, claim: int, iterations: int) -> int:
    """Check and clamp what the solver answered, and turn it into a command: the status."""
    solution = carray(pointer(solution_at), (solution_size(K.task, K.cascade, K.chain),), FLOAT)
    unpack(K.task, K.cascade, K.chain, K.qp, solution)
    K.cascade.qp_iterations = iterations
    return run_cascade(K, ANSWERED, claim)


@jit
def solve_by_network(K: Any, memory: Any, warm: int, prepared: int) -> int:
    """A prepared tick with the network in the place of the active set: the status.

    The other stages of the cascade use the active set. The warm start lives in the network's own memory and
    is dropped when ``warm`` is 0 (a fault, a reset), when the last tick did not end with a solved QP of the
    task, or when which variables are fixed has changed.
    """
    cascade, qp = K.cascade, K.qp
    if warm == 0:
        memory[VALID] = 0.0
    code = run_cascade(K, prepared, SOLVED)
    while code == QP_READY:
        code = run_cascade(K, ANSWERED, solve_planner_qp(cascade, qp, memory))
    qp.warm = 1 if cascade.stage == MAIN_STAGE and memory[VALID] != 0.0 else 0
    return code


@jit
def step_on_joints(K: Any, joints: Any) -> int:
    """The tick, solved in the kernel whatever the planner's mode and solver, which are put back."""
    task, cascade, qp, scene = K.task, K.cascade, K.qp, K.scene
    mode, external, keep, gain = task.mode, cascade.external, scene.keep, scene.gain
    task.mode, cascade.external = SLACK, 0
    scene.keep = max((1.0 - joints.spared) * keep, min(scene.halt, keep))
    scene.gain = gain / (1.0 - joints.spared)
    code = run_cascade(K, prepare_on_joints(K, joints), SOLVED)
    task.mode, cascade.external, scene.keep, scene.gain = mode, external, keep, gain
    qp.warm = 0
    if code == OK:
        size = worst = 0.0
        for i in range(K.chain.n):
            if K.faults.code[i] == HEALTHY:
                size = max(size, abs(joints.demand[i]))
                worst = max(worst, abs(qp.x[i] - joints.demand[i]))
        if worst > RELAXED_FROM * size + TASK_FLOOR:
            cascade.status = code = RELAXED
    return code


@jit
def tick_as_told(K: Any, given: Any, F: Any, q: Any, v: Any, target: Any) -> int:
    """The tick of the planner as it is configured now."""
    code = accept_numbers(K, q, v, target)
    if code < 0:
        return code
    if given.swings:
        return settle_beside_free(K, run_cascade(K, prepare_free(K, F), SOLVED))
    return settle(K, run_cascade(K, prepare(K), SOLVED))


@jit
def _follow(K: Any, given: Any, F: Any, path: Any, table: Any, q: Any, v: Any) -> int:
    """The tick along the path; where a joint swings freely, the path stands and the tip is held on it."""
    if given.swings and falls(K.faults, K.chain):
        path.rate = 0.0
        return tick_as_told(K, given, F, q, v, path.target)
    look_up(path, table, len(table), path.target)
    code = accept_numbers(K, q, v, path.target)
    if code < 0:
        return code
    code = run_cascade(K, prepare_on_path(K, path), SOLVED)
    advance(K.state, K.task, K.kinematics, K.chain, K.qp, path)
    return code


@jit
def deployed_step(K: Any, given: Any, F: Any, q: Any, v: Any, target: Any, ticks: int, work: Any) -> int:
    """A status, with NEWS, or a mistake, so many periods on; ``work``: 29 + n numbers, n zeros."""
    n = K.chain.n
    then, expected, rest = work[:TARGET_SIZE], work[TARGET_SIZE : TARGET_SIZE + n], work[TARGET_SIZE + n :]
    for left in range(min(ticks, MOST_TICKS) - 1, 0, -1):
        miss(K, target, left, expected, then)
        code = tick_as_told(K, given, F, expected, rest, then)
        K.state.unusable = ALL_USABLE
        if code < 0:
            return code
    return tick_as_told(K, given, F, q, v, target)


@jit
def deployed_go(K: Any, A: Any, W: Any, J: Any, S: Any, copies: Any, q: Any, v: Any) -> int:
    """The tick on the way to a posture: a status, with NEWS where something was found, or a mistake."""
    if K.state.is_reset:
        lead_going(K, A, W, J, S, copies)
    code = accept_numbers(K, q, v, W.target)
    if code < 0:
        return code
    for k in range(TARGET_SIZE):
        K.task.target[k] = 0.0
    code = step_on_joints(K, J)
    if code >= 0 and follow_going(K, W, S, code % NEWS) == GOING_RESTLESS:
        stop(K.watch, STOPPED_AS_ASKED)
    return code


@jit
def deployed_follow(
    K: Any, given: Any, F: Any, path: Any, table: Any, q: Any, v: Any, ticks: int, work: Any
) -> int:
    """The same along a path."""
    n = K.chain.n
    then, expected, rest = work[:TARGET_SIZE], work[TARGET_SIZE : TARGET_SIZE + n], work[TARGET_SIZE + n :]
    for left in range(min(ticks, MOST_TICKS) - 1, 0, -1):
        miss(K, path.target, left, expected, then)
        code = _follow(K, given, F, path, table, expected, rest)
        K.state.unusable = ALL_USABLE
        if code < 0:
            return code
    return _follow(K, given, F, path, table, q, v)
