"""A whole step for programs in C: the ticks that a late loop has missed, and the one that came."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ftqp.kernel.feedback.late_loop import miss
from ftqp.kernel.free.end_stop import stop_torques
from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.judge.fallback_cascade import run_cascade
from ftqp.kernel.layout.enums import ALL_USABLE, SOLVED, TARGET_SIZE
from ftqp.kernel.layout.free_memory import free_dtype
from ftqp.kernel.layout.record import record_dtype
from ftqp.kernel.layout.thresholds import MOST_TICKS
from ftqp.kernel.layout.told_memory import given_dtype
from ftqp.kernel.rows.turned_rows import turn_back
from ftqp.kernel.ticks.accepted_inputs import accept_numbers
from ftqp.kernel.ticks.tick import prepare_free, prepare_plain, prepare_rich

FLOAT = np.dtype(np.float64)


@jit
def tick_as_told(K: Any, given: Any, F: Any, q: Any, v: Any, target: Any) -> int:
    """The tick of the planner as it is told now."""
    code = accept_numbers(K, q, v, target)
    if code < 0:
        return code
    if given.swings:
        code = run_cascade(K, prepare_free(K, F), SOLVED)
        stop_torques(K.state, K.faults, K.kinematics, K.chain, K.free)
    elif given.rich:
        code = run_cascade(K, prepare_rich(K), SOLVED)
    else:
        return run_cascade(K, prepare_plain(K), SOLVED)
    if K.turned.on:
        turn_back(K.task, K.scratch, K.turned)
    return code


def deployed_step(capacity: int) -> Callable[..., int]:
    """A step from plain memory."""
    dtype, told, free = record_dtype(capacity), given_dtype(capacity), free_dtype(capacity)

    def deployed_step(
        address: int,
        given_at: int,
        free_at: int,
        q_at: int,
        v_at: int,
        target_at: int,
        ticks: int,
        work_at: int,
    ) -> int:
        """A status, or a mistake, so many periods after the last step.

        At ``work_at`` lie 29 + n numbers of memory, and n zeros.
        """
        K, G = carray(pointer(address), 1, dtype)[0], carray(pointer(given_at), 1, told)[0]
        F, n = carray(pointer(free_at), 1, free)[0], K.chain.n
        q, v = carray(pointer(q_at), (n,), FLOAT), carray(pointer(v_at), (n,), FLOAT)
        target = carray(pointer(target_at), (TARGET_SIZE,), FLOAT)
        if ticks > 1:
            then = carray(pointer(work_at), (TARGET_SIZE,), FLOAT)
            expected = carray(pointer(work_at + 8 * TARGET_SIZE), (n,), FLOAT)
            rest = carray(pointer(work_at + 8 * (TARGET_SIZE + n)), (n,), FLOAT)
            for k in range(min(ticks, MOST_TICKS) - 1):
                miss(K, target, min(ticks, MOST_TICKS) - 1 - k, expected, then)
                code = tick_as_told(K, G, F, expected, rest, then)
                K.state.unusable = ALL_USABLE
                if code < 0:
                    return code
        return tick_as_told(K, G, F, q, v, target)

    return deployed_step
