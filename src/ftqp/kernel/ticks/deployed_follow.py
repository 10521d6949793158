"""A step along a path for programs in C: the ticks that a late loop has missed, and the one that came."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ftqp.kernel.feedback.late_loop import miss
from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.judge.fallback_cascade import run_cascade
from ftqp.kernel.layout.enums import ALL_USABLE, SOLVED, TARGET_SIZE
from ftqp.kernel.layout.free_memory import free_dtype
from ftqp.kernel.layout.path_table import COLUMNS
from ftqp.kernel.layout.record import path_dtype, record_dtype
from ftqp.kernel.layout.thresholds import MOST_TICKS
from ftqp.kernel.layout.told_memory import given_dtype
from ftqp.kernel.rows.path_rows import advance
from ftqp.kernel.rows.path_sample import look_up
from ftqp.kernel.ticks.accepted_inputs import accept_numbers
from ftqp.kernel.ticks.deployed_step import tick_as_told
from ftqp.kernel.ticks.tick import prepare_on_path
from ftqp.kernel.told.believed import falls

FLOAT = np.dtype(np.float64)


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


def deployed_follow(capacity: int) -> Callable[..., int]:
    """A step along a path from plain memory."""
    dtype, told, free = record_dtype(capacity), given_dtype(capacity), free_dtype(capacity)
    lead = path_dtype(capacity)

    def deployed_follow(
        address: int,
        given_at: int,
        free_at: int,
        path_at: int,
        table_at: int,
        rows: int,
        q_at: int,
        v_at: int,
        ticks: int,
        work_at: int,
    ) -> int:
        """A status, or a mistake, so many periods after the last step.

        At ``work_at`` lie 29 + n numbers of memory, and n zeros.
        """
        K, G = carray(pointer(address), 1, dtype)[0], carray(pointer(given_at), 1, told)[0]
        F, path = carray(pointer(free_at), 1, free)[0], carray(pointer(path_at), 1, lead)[0]
        table, n = carray(pointer(table_at), (rows, COLUMNS), FLOAT), K.chain.n
        q, v = carray(pointer(q_at), (n,), FLOAT), carray(pointer(v_at), (n,), FLOAT)
        if ticks > 1:
            then = carray(pointer(work_at), (TARGET_SIZE,), FLOAT)
            expected = carray(pointer(work_at + 8 * TARGET_SIZE), (n,), FLOAT)
            rest = carray(pointer(work_at + 8 * (TARGET_SIZE + n)), (n,), FLOAT)
            for k in range(min(ticks, MOST_TICKS) - 1):
                miss(K, path.target, min(ticks, MOST_TICKS) - 1 - k, expected, then)
                code = _follow(K, G, F, path, table, expected, rest)
                K.state.unusable = ALL_USABLE
                if code < 0:
                    return code
        return _follow(K, G, F, path, table, q, v)

    return deployed_follow
