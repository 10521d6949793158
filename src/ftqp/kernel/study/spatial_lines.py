"""Straight lines of the tip of any healthy arm, through given poses."""

from collections.abc import Callable
from typing import Any, Final

import numpy as np

from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.layout.law_room import law_dtype
from ftqp.kernel.layout.study_room import GOAL_SIZE, study_dtype
from ftqp.kernel.study.resolved_rates import law_rates, led_rates

TURN: Final = 0.05
"""Of all joints together in one substep, at most [rad or m]."""
SUBSTEPS: Final = 400
"""Between two nodes; a line that takes more has failed at a singularity."""
CORRECTIONS: Final = 3
OFF: Final = 1e-7
"""A tip so far from its node after the corrections has failed [unit lengths]."""
FLOAT, WHOLE = np.dtype(np.float64), np.dtype(np.int64)


@jit
def _part(S: Any, L: Any) -> bool:
    """From a node to the next: classical Runge-Kutta steps with |dq| <= TURN; False where it fails."""
    n, left = S.chain.n, 1.0
    for _ in range(SUBSTEPS):
        if not led_rates(S, L, L.q, L.k1):
            return False
        h = min(left, TURN / max(L.speed, 1e-300))
        for i in range(n):
            L.next[i] = L.q[i] + 0.5 * h * L.k1[i]
        if not led_rates(S, L, L.next, L.k2):
            return False
        for i in range(n):
            L.next[i] = L.q[i] + 0.5 * h * L.k2[i]
        if not led_rates(S, L, L.next, L.k3):
            return False
        for i in range(n):
            L.next[i] = L.q[i] + h * L.k3[i]
        if not led_rates(S, L, L.next, L.k4):
            return False
        for i in range(n):
            L.q[i] += h / 6.0 * (L.k1[i] + 2.0 * (L.k2[i] + L.k3[i]) + L.k4[i])
        left -= h
        if not left > 0.0:
            return True
    return False


@jit
def _onto(S: Any, L: Any) -> bool:
    """Newton steps onto the goal that is set; False where it is missed."""
    for _ in range(CORRECTIONS):
        if not law_rates(S, L, L.q, L.v):
            return False
        for i in range(S.chain.n):
            L.q[i] += L.v[i]
    law_rates(S, L, L.q, L.v)
    return L.miss < OFF * L.unit


def study_lines(capacity: int) -> Callable[..., int]:
    """Lines of a healthy arm through the same poses from many starts."""
    study, law = study_dtype(capacity), law_dtype(capacity)

    def study_lines(
        address: int, law_at: int, count: int, K: int, starts_at: int, poses_at: int, twist_at: int,
        q_at: int, done_at: int,
    ) -> int:  # fmt: skip
        """Starts (count, n), poses (K + 1, 12), twist (m,) a part, q (count, K + 1, n), done (count,)."""
        S, L = carray(pointer(address), 1, study)[0], carray(pointer(law_at), 1, law)[0]
        n, m = S.chain.n, S.study.m
        starts = carray(pointer(starts_at), (count, n), FLOAT)
        poses = carray(pointer(poses_at), (K + 1, GOAL_SIZE), FLOAT)
        twist = carray(pointer(twist_at), (m,), FLOAT)
        q = carray(pointer(q_at), (count, K + 1, n), FLOAT)
        done = carray(pointer(done_at), (count,), WHOLE)
        for r in range(m):
            L.wanted[r] = twist[r]
        for i in range(n):
            L.free[i] = 1.0
        for c in range(count):
            for i in range(n):
                L.q[i] = starts[c, i]
                q[c, 0, i] = starts[c, i]
            done[c] = 0
            for k in range(1, K + 1):
                if not _part(S, L):
                    break
                for j in range(GOAL_SIZE):
                    S.study.goal[j] = poses[k, j]
                if not _onto(S, L):
                    break
                for i in range(n):
                    q[c, k, i] = L.q[i]
                done[c] = k
        return 0

    return study_lines
