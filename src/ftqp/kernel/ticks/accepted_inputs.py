"""What a caller hands to a tick, copied into the record: nothing of it is remembered."""

from typing import Any

from ftqp.kernel.compiled.taking import take
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import (
    NO_ROTATION,
    NOT_READ,
    NOT_RESET,
    TARGET_HAS_ROTATION,
    TARGET_SIZE,
    TWIST_ALONE,
    WRONG_SHAPE,
)

MOST_ROWS = 1 << 40
"""More rows of targets than any memory holds, few enough that their numbers can be counted."""


@jit
def accept_arrays(K: Any, q: Any, v: Any) -> int:
    """Copy q, (n,) or (nq,), and v, (n,): how many numbers q has, or a mistake (negative).

    Args:
        K: the record.
        q: any object with a buffer of contiguous float64; its address in compiled code.
        v: the same.
    """
    chain, state = K.chain, K.state
    nq = take(q, 0, state.given_q.ctypes.data, len(state.given_q), 1)
    nv = take(v, 0, state.given_v.ctypes.data, len(state.given_v), 1)
    if nq < 0 or nv < 0:
        return NOT_READ
    if (nq != chain.n and nq != chain.nq) or nv != chain.n:
        return WRONG_SHAPE
    if not state.is_reset:
        return NOT_RESET
    return nq


@jit
def accept_target(K: Any, target: Any, row: int) -> int:
    """Copy row ``row`` of packed targets: 0, or a mistake (negative)."""
    task = K.task
    if row < 0 or row > MOST_ROWS:
        return NOT_READ
    if take(target, row * TARGET_SIZE, task.target.ctypes.data, TARGET_SIZE, 0) < TARGET_SIZE:
        return NOT_READ
    if task.target[TARGET_HAS_ROTATION] <= 0.0:
        if task.target[TARGET_HAS_ROTATION] < 0.0:
            return TWIST_ALONE
        if task.uses_rotation:
            return NO_ROTATION
    return 0
