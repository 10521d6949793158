"""Continuations after failures, and motions at a given self-motion speed, of many starts each."""

from collections.abc import Callable

import numpy as np

from ftqp.kernel.continuation.bounded_runs import bounded_run
from ftqp.kernel.continuation.exact_runs import exact_run
from ftqp.kernel.continuation.failing import begin
from ftqp.kernel.continuation.self_speed import self_speed_run
from ftqp.kernel.jit import carray, pointer
from ftqp.kernel.layout.continuation_room import FACTS, FAILED_JOINTS, continuation_dtype
from ftqp.kernel.layout.study_room import GOAL_SIZE, study_dtype

_FLOAT, _WHOLE = np.dtype(np.float64), np.dtype(np.int64)


def _continuations(capacity: int, name: str, run: Callable[..., int]) -> Callable[..., int]:
    """Continuations of many starts by one rule, under the name of their entry."""
    study, continuation = study_dtype(capacity), continuation_dtype(capacity)

    def continuations(address: int, memory_at: int, table_at: int, first: int, last: int) -> int:
        """Starts ``first`` to ``last - 1``.

        The table holds the numbers of starts k and of samples N + 1, and whether motions are kept, then
        addresses: goals (N + 1, 12), q (k, n), samples of the failures (k,), failed joints (k, 2), their
        speeds (k, 2), facts (k, 7), and the motion that is kept (N + 1, n).
        """
        S, C = carray(pointer(address), 1, study)[0], carray(pointer(memory_at), 1, continuation)[0]
        n = S.chain.n
        table = carray(pointer(table_at), (10,), _WHOLE)
        k, samples, keep = table[0], table[1], table[2]
        goals = carray(pointer(table[3]), (samples, GOAL_SIZE), _FLOAT)
        q = carray(pointer(table[4]), (k, n), _FLOAT)
        at = carray(pointer(table[5]), (k,), _WHOLE)
        failed = carray(pointer(table[6]), (k, FAILED_JOINTS), _WHOLE)
        speed = carray(pointer(table[7]), (k, FAILED_JOINTS), _FLOAT)
        facts = carray(pointer(table[8]), (k, FACTS), _FLOAT)
        path = carray(pointer(table[9]), (samples, n), _FLOAT)
        for s in range(first, last):
            begin(S, C, q[s], failed[s], speed[s])
            facts[s, 0] = run(S, C, goals, at[s], path, keep)
            facts[s, 1], facts[s, 2], facts[s, 3] = C.sample, C.position, C.rotation
            facts[s, 4], facts[s, 5], facts[s, 6] = C.margin, C.hurry, C.clearance
        return 0

    continuations.__name__ = name
    return continuations


def exact_continuations(capacity: int) -> Callable[..., int]:
    """Continuations of joints that are as many as the task's rows."""
    return _continuations(capacity, "exact_continuations", exact_run)


def bounded_continuations(capacity: int) -> Callable[..., int]:
    """Continuations by one bounded QP a sample."""
    return _continuations(capacity, "bounded_continuations", bounded_run)


def self_speed_tracks(capacity: int) -> Callable[..., int]:
    """Motions along a path at given self-motion speeds."""
    study, continuation = study_dtype(capacity), continuation_dtype(capacity)

    def self_speed_tracks(address: int, memory_at: int, table_at: int, first: int, last: int) -> int:
        """Motions ``first`` to ``last - 1``.

        The table holds the numbers of motions k and of samples N + 1, then addresses: goals (N + 1, 12),
        speeds (k, N), q (k, N + 1, n) with the starts in its row 0, facts (k, 2): last sample, error.
        """
        S, C = carray(pointer(address), 1, study)[0], carray(pointer(memory_at), 1, continuation)[0]
        n = S.chain.n
        table = carray(pointer(table_at), (6,), _WHOLE)
        k, samples = table[0], table[1]
        goals = carray(pointer(table[2]), (samples, GOAL_SIZE), _FLOAT)
        speeds = carray(pointer(table[3]), (k, samples - 1), _FLOAT)
        q = carray(pointer(table[4]), (k, samples, n), _FLOAT)
        facts = carray(pointer(table[5]), (k, 2), _FLOAT)
        for s in range(first, last):
            done, worst = self_speed_run(S, goals, C.dt, speeds[s], q[s])
            facts[s, 0], facts[s, 1] = done, worst
        return 0

    return self_speed_tracks
