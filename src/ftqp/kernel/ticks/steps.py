"""A whole tick with the in-kernel solver, one factory for each leader of the arm.

A factory makes the entry point of one class of records; ``ftqp.kernel.entry.table`` lists them with the
kinds of their arguments. Arguments that end in ``_at`` are addresses of memory that the session keeps alive;
q, v and target are the caller's own objects, which are copied and not remembered. Every entry returns a
status, or a mistake (negative).
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from ftqp.kernel.free.end_stop import stop_torques
from ftqp.kernel.jit import carray, jit, part_jit, pointer
from ftqp.kernel.judge.fallback_cascade import run_cascade
from ftqp.kernel.layout.enums import HEALTHY, OK, RELAXED, SLACK, SOLVED, TARGET_SIZE
from ftqp.kernel.layout.free_memory import free_dtype
from ftqp.kernel.layout.path_table import COLUMNS
from ftqp.kernel.layout.record import base_dtype, joints_dtype, path_dtype, record_dtype
from ftqp.kernel.layout.thresholds import RELAXED_FROM, TASK_FLOOR
from ftqp.kernel.rows.inertial_target import base_verdict
from ftqp.kernel.rows.path_rows import advance
from ftqp.kernel.rows.path_sample import look_up
from ftqp.kernel.rows.turned_rows import turn_back
from ftqp.kernel.ticks.accepted_inputs import accept_arrays, accept_state, accept_target
from ftqp.kernel.ticks.tick import (
    prepare_free,
    prepare_on_base,
    prepare_on_joints,
    prepare_on_path,
    prepare_plain,
    prepare_rich,
)

FLOAT = np.dtype(np.float64)


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
    for k in range(TARGET_SIZE):
        K.task.target[k] = path.target[k]
    accept_state(K.state, K.chain, nq)
    return 0


@jit
def settle_on_base(K: Any, base: Any) -> None:
    """After a tick above a moving base: the slack along the task's rows, the set point, and the verdict."""
    if K.turned.on:
        turn_back(K.task, K.scratch, K.turned)
    base.code = base_verdict(K, base)


@jit
def accept_on_joints(state: Any, task: Any, gate: Any, chain: Any, q: Any, v: Any) -> int:
    """Copy the state, which is all that a motion of the joints is given: 0, or a mistake."""
    nq = accept_arrays(state, gate, chain, q, v)
    if nq < 0:
        return nq
    for k in range(TARGET_SIZE):
        task.target[k] = 0.0
    accept_state(state, chain, nq)
    return 0


@jit
def step_on_joints(K: Any, joints: Any) -> int:
    """The tick, solved in the kernel whatever the planner's mode and solver, which are put back."""
    task, cascade, qp = K.task, K.cascade, K.qp
    mode, external = task.mode, cascade.external
    task.mode, cascade.external = SLACK, 0
    code = run_cascade(K, prepare_on_joints(K, joints), SOLVED)
    task.mode, cascade.external = mode, external
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


def step(capacity: int) -> Callable[..., int]:
    """A tick led by the clock."""
    dtype = record_dtype(capacity)

    def step(address: int, q: Any, v: Any, target: Any, row: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        code = accept(K, q, v, target, row)
        if code < 0:
            return code
        return run_cascade(K, prepare_plain(K), SOLVED)

    return step


def step_rich(capacity: int) -> Callable[..., int]:
    """A tick led by the clock, with directional damping or a gradient of the manipulability."""
    dtype = record_dtype(capacity)

    def step_rich(address: int, q: Any, v: Any, target: Any, row: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        code = accept(K, q, v, target, row)
        if code < 0:
            return code
        code = run_cascade(K, prepare_rich(K), SOLVED)
        if K.turned.on:
            turn_back(K.task, K.scratch, K.turned)
        return code

    return step_rich


def step_free(capacity: int) -> Callable[..., int]:
    """A tick of an arm with a free-swinging joint, whoever led it before."""
    dtype, work = record_dtype(capacity), free_dtype(capacity)

    def step_free(address: int, free_at: int, q: Any, v: Any, target: Any, row: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        F = carray(pointer(free_at), 1, work)[0]
        code = accept(K, q, v, target, row)
        if code < 0:
            return code
        code = run_cascade(K, prepare_free(K, F), SOLVED)
        if K.turned.on:
            turn_back(K.task, K.scratch, K.turned)
        stop_torques(K.state, K.faults, K.kinematics, K.chain, K.free)
        return code

    return step_free


def step_path(capacity: int) -> Callable[..., int]:
    """A tick led by the progress along a path."""
    dtype, lead = record_dtype(capacity), path_dtype(capacity)

    def step_path(address: int, path_at: int, table_at: int, rows: int, q: Any, v: Any) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        path = carray(pointer(path_at), 1, lead)[0]
        code = accept_on_path(K, path, carray(pointer(table_at), (rows, COLUMNS), FLOAT), q, v)
        if code < 0:
            return code
        code = run_cascade(K, prepare_on_path(K, path), SOLVED)
        advance(K.state, K.task, K.kinematics, K.chain, K.qp, path)
        return code

    return step_path


def step_base(capacity: int) -> Callable[..., int]:
    """A tick led by an inertial target above a base that moves."""
    dtype, lead = record_dtype(capacity), base_dtype(capacity)

    def step_base(address: int, base_at: int, q: Any, v: Any, target: Any, row: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        base = carray(pointer(base_at), 1, lead)[0]
        code = accept(K, q, v, target, row)
        if code < 0:
            return code
        code = run_cascade(K, prepare_on_base(K, base), SOLVED)
        settle_on_base(K, base)
        return code

    return step_base


def step_joints(capacity: int) -> Callable[..., int]:
    """A tick led by a motion of the joints."""
    dtype, lead = record_dtype(capacity), joints_dtype(capacity)

    def step_joints(address: int, joints_at: int, q: Any, v: Any) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        joints = carray(pointer(joints_at), 1, lead)[0]
        code = accept_on_joints(K.state, K.task, K.gate, K.chain, q, v)
        if code < 0:
            return code
        return step_on_joints(K, joints)

    return step_joints
