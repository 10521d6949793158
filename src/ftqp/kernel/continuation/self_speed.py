"""Motions along a path at a given self-motion speed, corrected onto the path at every sample.

Source: docs/theory/coverage.md, "Self-motion at a given speed".
"""

from math import inf
from typing import Any

from ftqp.kernel.continuation.exact_runs import aim
from ftqp.kernel.jit import jit
from ftqp.kernel.maths.linear_systems import determinant_sign, lu_factor
from ftqp.kernel.study.task_values import any_null_direction, decompose, least_step, task_values

CORRECTIONS = 8
"""Newton steps at a sample at most."""
CONVERGED = 1e-11
"""Largest entry of an error that counts as none [m]. Newton's error falls to rounding one step later."""
FOLLOWED = 1e-8
"""An error from which on the path is lost [m]. A thousand times the above, so that rounding of a long arm
loses no path."""


@jit
def side_of(S: Any, t: Any) -> float:
    """The sign of det [t; A], of an arm with one joint more than task rows: n with t = n gives +1."""
    study, n = S.study, S.chain.n
    M = study.square
    for i in range(n):
        M[0, i] = t[i]
        for row in range(study.m):
            M[row + 1, i] = study.A[row, i]
    lu_factor(M, n, study.pivot)
    return determinant_sign(M, n, study.pivot)


@jit
def self_speed_run(S: Any, goals: Any, dt: float, speeds: Any, path: Any) -> tuple[int, float]:
    """q += dt speed n, then q += A^+ e until e counts as none; the last sample that was reached, and |e|.

    n is the unit null vector with det [n; A] > 0. The path begins at its row 0, and rows behind the last
    sample are left as they are. Where all speeds are 0 the arm may have any number of joints.
    """
    n = S.chain.n
    worst = 0.0
    for i in range(n):
        S.state.q[i] = path[0, i]
    for k in range(len(goals) - 1):
        if speeds[k] != 0.0:
            task_values(S)
            decompose(S)
            any_null_direction(S, S.study.tangent)
            way = dt * speeds[k] * side_of(S, S.study.tangent)
            for i in range(n):
                S.state.q[i] += way * S.study.tangent[i]
        aim(S, goals[k + 1])
        largest = inf
        for _ in range(CORRECTIONS):
            task_values(S)
            largest = 0.0
            for row in range(S.study.m):
                largest = max(largest, abs(S.study.e[row]))
            if not largest >= CONVERGED:
                break
            decompose(S)
            least_step(S, 0.0)
            for i in range(n):
                S.state.q[i] += S.study.dq[i]
        if not largest < FOLLOWED:
            return k, worst
        worst = max(worst, largest)
        for i in range(n):
            path[k + 1, i] = S.state.q[i]
    return len(goals) - 1, worst
