"""A whole step for programs in C: the ticks that a late loop has missed, and the one that came."""

from typing import Any

from ftqp.kernel.feedback.late_loop import miss
from ftqp.kernel.jit import jit
from ftqp.kernel.judge.fallback_cascade import run_cascade
from ftqp.kernel.layout.enums import ALL_USABLE, SOLVED, TARGET_SIZE
from ftqp.kernel.layout.flat_arrays import COLUMNS
from ftqp.kernel.layout.thresholds import MOST_TICKS
from ftqp.kernel.rows.path_rows import advance, look_up
from ftqp.kernel.ticks.accepted_inputs import accept_numbers
from ftqp.kernel.ticks.steps import settle, settle_beside_free
from ftqp.kernel.ticks.tick import prepare_free, prepare_on_path, prepare_plain, prepare_rich
from ftqp.kernel.told.believed import falls

__all__ = ["COLUMNS", "TARGET_SIZE"]


@jit
def _tick(K: Any, given: Any, F: Any, q: Any, v: Any, target: Any) -> int:
    """The tick of the planner as it is told now."""
    code = accept_numbers(K, q, v, target)
    if code < 0:
        return code
    if given.swings:
        return settle_beside_free(K, run_cascade(K, prepare_free(K, F), SOLVED))
    if given.rich:
        return settle(K, run_cascade(K, prepare_rich(K), SOLVED))
    return run_cascade(K, prepare_plain(K), SOLVED)


@jit
def _follow(K: Any, given: Any, F: Any, path: Any, table: Any, q: Any, v: Any) -> int:
    """The tick along the path; where a joint swings freely, the path stands and the tip is held on it."""
    if given.swings and falls(K.faults, K.chain):
        path.rate = 0.0
        return _tick(K, given, F, q, v, path.target)
    look_up(path, table, len(table), path.target)
    code = accept_numbers(K, q, v, path.target)
    if code < 0:
        return code
    code = run_cascade(K, prepare_on_path(K, path), SOLVED)
    advance(K.state, K.task, K.kinematics, K.chain, K.qp, path)
    return code


@jit
def deployed_step(K: Any, given: Any, F: Any, q: Any, v: Any, target: Any, ticks: int, work: Any) -> int:
    """A status, or a mistake, so many periods after the last step; ``work``: 29 + n numbers, and n zeros."""
    n = K.chain.n
    then, expected, rest = work[:TARGET_SIZE], work[TARGET_SIZE : TARGET_SIZE + n], work[TARGET_SIZE + n :]
    for left in range(min(ticks, MOST_TICKS) - 1, 0, -1):
        miss(K, target, left, expected, then)
        code = _tick(K, given, F, expected, rest, then)
        K.state.unusable = ALL_USABLE
        if code < 0:
            return code
    return _tick(K, given, F, q, v, target)


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
