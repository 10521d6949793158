"""Runs of any arm after one joint has locked and nobody was told: the same verdicts as of planar arms."""

from collections.abc import Callable
from math import sqrt
from typing import Any, Final

import numpy as np

from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.layout.endings import NONE
from ftqp.kernel.layout.law_room import law_dtype
from ftqp.kernel.layout.study_room import study_dtype
from ftqp.kernel.study.planar_arm import SHARE
from ftqp.kernel.study.planar_rest import MOVING
from ftqp.kernel.study.resolved_rates import law_rates
from ftqp.kernel.study.spatial_rest import verdict
from ftqp.kernel.study.spatial_stiff import creep
from ftqp.kernel.study.task_values import task_values
from ftqp.kernel.study.tracing import put_joints

STEPS: Final = 1000
"""After so many trial steps a run goes on by a method for stiff equations."""
FLOAT, WHOLE = np.dtype(np.float64), np.dtype(np.int64)


@jit
def _scaled(S: Any, L: Any, q: Any, out: Any) -> None:
    """dq/ds = v / (c + |v|) into ``out``."""
    law_rates(S, L, q, out)
    scale = 1.0 / (SHARE + L.speed)
    for i in range(S.chain.n):
        out[i] *= scale


@jit
def one_run(S: Any, L: Any) -> int:
    """How the run from ``q`` ends by steps of orders 3 and 2; its end is in ``trial``, else in ``q``.

    Source: Bogacki and Shampine 1989, the 3(2) pair.
    """
    n, h, way = S.chain.n, 0.05, 0.0
    _scaled(S, L, L.q, L.k1)
    size, speed = L.miss, L.speed
    for step in range(STEPS):
        if step % 4 == 0:
            ending = verdict(S, L, size, speed, way)
            if ending != MOVING:
                return ending
        for i in range(n):
            L.next[i] = L.q[i] + 0.5 * h * L.k1[i]
        _scaled(S, L, L.next, L.k2)
        for i in range(n):
            L.next[i] = L.q[i] + 0.75 * h * L.k2[i]
        _scaled(S, L, L.next, L.k3)
        for i in range(n):
            L.next[i] = L.q[i] + h * (2.0 * L.k1[i] + 3.0 * L.k2[i] + 4.0 * L.k3[i]) / 9.0
        _scaled(S, L, L.next, L.k4)
        wrong, moved = 0.0, 0.0
        for i in range(n):
            miss = -5.0 / 72.0 * L.k1[i] + L.k2[i] / 12.0 + L.k3[i] / 9.0 - 0.125 * L.k4[i]
            wrong += miss * miss
            moved += (L.next[i] - L.q[i]) ** 2
        wrong = h * sqrt(wrong) / L.tolerance
        if wrong <= 1.0:
            size, speed, way = L.miss, L.speed, way + sqrt(moved)
            for i in range(n):
                L.q[i], L.k1[i] = L.next[i], L.k4[i]
        h = min(1.0, h * min(5.0, max(0.2, 0.9 / (wrong + 1e-9) ** (1.0 / 3.0))))
    return creep(S, L, way)


def study_runs(capacity: int) -> Callable[..., int]:
    """Runs of an arm after failures."""
    study, law = study_dtype(capacity), law_dtype(capacity)

    def study_runs(
        address: int, law_at: int, count: int, q_at: int, locked_at: int, endings_at: int, sizes_at: int
    ) -> int:
        """Rows q (count, n) from start to end, locked joints (count,), endings (count,), |e| (count,)."""
        S, L = carray(pointer(address), 1, study)[0], carray(pointer(law_at), 1, law)[0]
        n = S.chain.n
        q, locked = carray(pointer(q_at), (count, n), FLOAT), carray(pointer(locked_at), (count,), WHOLE)
        endings = carray(pointer(endings_at), (count,), WHOLE)
        sizes = carray(pointer(sizes_at), (count,), FLOAT)
        for k in range(count):
            for i in range(n):
                L.q[i] = q[k, i]
                L.free[i] = 0.0 if i == locked[k] else 1.0
            endings[k] = one_run(S, L)
            put_joints(S, L.q if endings[k] == NONE else L.trial)
            sizes[k] = task_values(S)
            for i in range(n):
                q[k, i] = S.state.q[i]
        return 0

    return study_runs
