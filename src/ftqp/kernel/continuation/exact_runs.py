"""Motions whose joints that are left are as many as the task's rows: Newton steps from sample to sample.

Source: docs/theory/coverage.md, "The continuation".
"""

from typing import Any

from ftqp.kernel.continuation.failing import note_errors, note_motion, put_locked
from ftqp.kernel.continuation.passing_bodies import note_clearance
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import (
    LIMIT,
    LOST_BY_SINGULARITY,
    LOST_BY_VELOCITY,
    NOT_CONVERGED,
    SINGULAR_VELOCITY,
    SURVIVED,
    TOO_NEAR,
)
from ftqp.kernel.layout.other_records import GOAL_SIZE
from ftqp.kernel.maths.lu import determinant_sign, lu_factor, lu_solve
from ftqp.kernel.study.task_values import task_values

CORRECTIONS = 6
"""Newton steps at a sample at most; one or two are usual."""
CONVERGED = 1e-10
"""Largest entry of an error that counts as none [m]. Newton's error falls to rounding one step later."""
LONGEST = 0.5
"""Largest entry of a Newton step [rad or m]."""
DEPENDENT = 1e-9
"""A pivot below this share of the largest means that the joints that are left cannot move the task."""


@jit
def aim(S: Any, goal: Any) -> None:
    """The goal of the study."""
    for k in range(GOAL_SIZE):
        S.study.goal[k] = goal[k]


@jit
def factor_left(S: Any, C: Any) -> float:
    """LU of the columns of A of the joints that move into ``B``; the sign of their determinant."""
    m = S.study.m
    for row in range(m):
        for c in range(m):
            C.B[row, c] = S.study.A[row, C.free[c]]
    lu_factor(C.B, m, C.pivots)
    return determinant_sign(C.B, m, C.pivots)


@jit
def _is_dependent(S: Any, C: Any) -> bool:
    """Whether a pivot of ``B`` counts as zero; inverse pivots are on its diagonal."""
    low, high = 1e300, 0.0
    for k in range(S.study.m):
        inverse = abs(C.B[k, k])
        pivot = 1.0 / inverse if inverse > 0.0 else 0.0
        low, high = min(low, pivot), max(high, pivot)
    return not low > DEPENDENT * high


@jit
def _newton(S: Any, C: Any, side: float) -> int:
    """Bring ``state.q`` to the goal with the joints that move, on its side of the singularity."""
    study, m = S.study, S.study.m
    for _ in range(CORRECTIONS):
        task_values(S)
        largest = 0.0
        for row in range(m):
            largest = max(largest, abs(study.e[row]))
        if largest < CONVERGED:
            return SURVIVED
        if factor_left(S, C) != side:
            return LOST_BY_SINGULARITY
        for row in range(m):
            C.rhs[row] = study.e[row]
        lu_solve(C.B, m, C.pivots, C.rhs)
        for c in range(m):
            S.state.q[C.free[c]] += min(max(C.rhs[c], -LONGEST), LONGEST)
    task_values(S)
    return SURVIVED


@jit
def _steps(S: Any, C: Any, goals: Any, first: int, path: Any, keep: int) -> int:
    """The samples behind the failure, one after the other; whether limits of speed are kept is noted only."""
    n, q = S.chain.n, S.state.q
    C.sample = first
    aim(S, goals[first])
    task_values(S)
    side = factor_left(S, C)
    if _is_dependent(S, C):
        return LOST_BY_SINGULARITY
    if not note_clearance(S, C):
        return TOO_NEAR
    for k in range(first, len(goals) - 1):
        C.sample = k + 1
        for i in range(n):
            C.here[i] = q[i]
            q[i] += C.step[i]
        put_locked(S, C, (k + 1 - first) * C.dt)
        aim(S, goals[k + 1])
        if _newton(S, C, side) == LOST_BY_SINGULARITY:
            return LOST_BY_SINGULARITY
        if not note_errors(S, C):
            return NOT_CONVERGED
        for i in range(n):
            C.step[i] = q[i] - C.here[i]
            if keep:
                path[k + 1 - first, i] = q[i]
        if not note_motion(S, C, k + 1):
            return LIMIT
        if not note_clearance(S, C):
            return TOO_NEAR
    if factor_left(S, C) != side:
        return LOST_BY_SINGULARITY
    return SURVIVED


@jit
def exact_run(S: Any, C: Any, goals: Any, first: int, path: Any, keep: int) -> int:
    """How the motion from ``state.q`` ends whose joints have failed at a sample; see ``Survival``.

    Each sample starts from the last increments and is reached by Newton steps of the joints
    that move. Where the determinant of their columns has changed its sign a coarse step has jumped over a
    singularity, to another branch. A speed limit that is broken on the way to a singularity is the
    singularity's first sign.

    Args:
        S: The record of the study.
        C: Memory of the continuation, as ``begin`` leaves it.
        goals: Of all samples, (N + 1, 12).
        first: The sample at which the joints fail.
        path: Where ``keep`` is 1, filled with the samples from there on, (N + 1 - first, n).
        keep: As above.
    """
    ending = _steps(S, C, goals, first, path, keep)
    if C.fast >= 0:
        C.sample = min(C.sample, C.fast)
        if ending == SURVIVED:
            return LOST_BY_VELOCITY
        if ending == LOST_BY_SINGULARITY or ending == NOT_CONVERGED:
            return SINGULAR_VELOCITY
    return ending
