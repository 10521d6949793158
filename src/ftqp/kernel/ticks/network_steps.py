"""A whole tick with the recurrent network in the place of the active set.

The other stages of the cascade use the active set. The warm start lives in the network's own memory and is
dropped when ``K.qp.warm`` is 0 (a fault, a reset), when the last tick did not end with a solved QP of the
task, or when which variables are fixed has changed.
"""

from collections.abc import Callable
from typing import Any

from ftqp.kernel.dtrnn.planner_qp import solve_planner_qp
from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.judge.fallback_cascade import run_cascade
from ftqp.kernel.layout.enums import ANSWERED, MAIN_STAGE, QP_READY, SOLVED
from ftqp.kernel.layout.network_memory import VALID
from ftqp.kernel.layout.path_table import COLUMNS
from ftqp.kernel.layout.record import base_dtype, path_dtype, record_dtype
from ftqp.kernel.rows.path_rows import advance
from ftqp.kernel.rows.turned_rows import turn_back
from ftqp.kernel.ticks.steps import FLOAT, accept, accept_on_path, settle_on_base
from ftqp.kernel.ticks.tick import prepare_on_base, prepare_on_path, prepare_rich


@jit
def _solved(K: Any, memory: Any, warm: int, prepared: int) -> int:
    """A prepared tick with the network: the status."""
    cascade, qp = K.cascade, K.qp
    if warm == 0:
        memory[VALID] = 0.0
    code = run_cascade(K, prepared, SOLVED)
    while code == QP_READY:
        code = run_cascade(K, ANSWERED, solve_planner_qp(cascade, qp, memory))
    qp.warm = 1 if cascade.stage == MAIN_STAGE and memory[VALID] != 0.0 else 0
    return code


def network_clock(capacity: int) -> Callable[..., int]:
    """A tick led by the clock."""
    dtype = record_dtype(capacity)

    def network_clock(
        address: int, memory_at: int, numbers: int, q: Any, v: Any, target: Any, row: int
    ) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        code = accept(K, q, v, target, row)
        if code < 0:
            return code
        warm = K.qp.warm
        code = _solved(K, carray(pointer(memory_at), (numbers,), FLOAT), warm, prepare_rich(K))
        if K.turned.on:
            turn_back(K.task, K.scratch, K.turned)
        return code

    return network_clock


def network_path(capacity: int) -> Callable[..., int]:
    """A tick led by the progress along a path."""
    dtype, lead = record_dtype(capacity), path_dtype(capacity)

    def network_path(
        address: int, memory_at: int, numbers: int, path_at: int, table_at: int, rows: int, q: Any, v: Any
    ) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        path = carray(pointer(path_at), 1, lead)[0]
        code = accept_on_path(K, path, carray(pointer(table_at), (rows, COLUMNS), FLOAT), q, v)
        if code < 0:
            return code
        warm = K.qp.warm
        code = _solved(K, carray(pointer(memory_at), (numbers,), FLOAT), warm, prepare_on_path(K, path))
        advance(K.state, K.task, K.kinematics, K.chain, K.qp, path)
        return code

    return network_path


def network_base(capacity: int) -> Callable[..., int]:
    """A tick led by an inertial target above a base that moves."""
    dtype, lead = record_dtype(capacity), base_dtype(capacity)

    def network_base(
        address: int, memory_at: int, numbers: int, base_at: int, q: Any, v: Any, target: Any, row: int
    ) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        base = carray(pointer(base_at), 1, lead)[0]
        code = accept(K, q, v, target, row)
        if code < 0:
            return code
        warm = K.qp.warm
        code = _solved(K, carray(pointer(memory_at), (numbers,), FLOAT), warm, prepare_on_base(K, base))
        settle_on_base(K, base)
        return code

    return network_base
