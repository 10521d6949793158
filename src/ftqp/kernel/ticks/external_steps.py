"""A tick in two halves, with an external solver in between: the QP goes out, its answer comes back."""

from collections.abc import Callable
from typing import Any

from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.judge.external_qp import pack, packed_size, solution_size, unpack
from ftqp.kernel.judge.fallback_cascade import run_cascade
from ftqp.kernel.layout.enums import ANSWERED, QP_READY, SOLVED
from ftqp.kernel.layout.path_table import COLUMNS
from ftqp.kernel.layout.record import base_dtype, path_dtype, record_dtype
from ftqp.kernel.rows.path_rows import advance
from ftqp.kernel.rows.turned_rows import turn_back
from ftqp.kernel.ticks.steps import FLOAT, accept, accept_on_path, settle_on_base
from ftqp.kernel.ticks.tick import prepare_on_base, prepare_on_path, prepare_rich


@jit
def _hand_over(K: Any, prepared: int, flat_at: int) -> int:
    """The QP into memory when it waits for a solver: QP_READY, or the status of a tick that needed none."""
    code = run_cascade(K, prepared, SOLVED)
    if code == QP_READY:
        pack(
            K.task,
            K.cascade,
            K.chain,
            K.qp,
            carray(pointer(flat_at), (packed_size(K.task, K.cascade, K.chain),), FLOAT),
        )
    return code


@jit
def _take_back(K: Any, solution_at: int, claim: int, iterations: int) -> int:
    """Judge and clamp what the solver answered, and turn it into a command: the status."""
    unpack(
        K.task,
        K.cascade,
        K.chain,
        K.qp,
        carray(pointer(solution_at), (solution_size(K.task, K.cascade, K.chain),), FLOAT),
    )
    K.cascade.qp_iterations = iterations
    return run_cascade(K, ANSWERED, claim)


def prepare_clock(capacity: int) -> Callable[..., int]:
    """The first half of a tick led by the clock."""
    dtype = record_dtype(capacity)

    def prepare_clock(address: int, flat_at: int, q: Any, v: Any, target: Any, row: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        code = accept(K, q, v, target, row)
        if code < 0:
            return code
        code = _hand_over(K, prepare_rich(K), flat_at)
        if code != QP_READY and K.turned.on:
            turn_back(K.task, K.scratch, K.turned)
        return code

    return prepare_clock


def finish_clock(capacity: int) -> Callable[..., int]:
    """The second half of a tick led by the clock."""
    dtype = record_dtype(capacity)

    def finish_clock(address: int, solution_at: int, claim: int, iterations: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        code = _take_back(K, solution_at, claim, iterations)
        if K.turned.on:
            turn_back(K.task, K.scratch, K.turned)
        return code

    return finish_clock


def prepare_path(capacity: int) -> Callable[..., int]:
    """The first half of a tick led by the progress along a path."""
    dtype, lead = record_dtype(capacity), path_dtype(capacity)

    def prepare_path(
        address: int, flat_at: int, path_at: int, table_at: int, rows: int, q: Any, v: Any
    ) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        path = carray(pointer(path_at), 1, lead)[0]
        code = accept_on_path(K, path, carray(pointer(table_at), (rows, COLUMNS), FLOAT), q, v)
        if code < 0:
            return code
        code = _hand_over(K, prepare_on_path(K, path), flat_at)
        if code != QP_READY:
            advance(K.state, K.task, K.kinematics, K.chain, K.qp, path)
        return code

    return prepare_path


def finish_path(capacity: int) -> Callable[..., int]:
    """The second half of a tick led by the progress along a path."""
    dtype, lead = record_dtype(capacity), path_dtype(capacity)

    def finish_path(address: int, path_at: int, solution_at: int, claim: int, iterations: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        code = _take_back(K, solution_at, claim, iterations)
        advance(K.state, K.task, K.kinematics, K.chain, K.qp, carray(pointer(path_at), 1, lead)[0])
        return code

    return finish_path


def prepare_base(capacity: int) -> Callable[..., int]:
    """The first half of a tick led by an inertial target."""
    dtype, lead = record_dtype(capacity), base_dtype(capacity)

    def prepare_base(address: int, flat_at: int, base_at: int, q: Any, v: Any, target: Any, row: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        base = carray(pointer(base_at), 1, lead)[0]
        code = accept(K, q, v, target, row)
        if code < 0:
            return code
        code = _hand_over(K, prepare_on_base(K, base), flat_at)
        if code != QP_READY:
            settle_on_base(K, base)
        return code

    return prepare_base


def finish_base(capacity: int) -> Callable[..., int]:
    """The second half of a tick led by an inertial target."""
    dtype, lead = record_dtype(capacity), base_dtype(capacity)

    def finish_base(address: int, base_at: int, solution_at: int, claim: int, iterations: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        code = _take_back(K, solution_at, claim, iterations)
        settle_on_base(K, carray(pointer(base_at), 1, lead)[0])
        return code

    return finish_base
