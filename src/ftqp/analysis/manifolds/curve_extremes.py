"""The smallest and the largest value of a joint on a traced curve, exact to rounding."""

import numpy as np
from scipy.optimize import brentq

from ftqp.analysis.goals import STEP, GoalStudy
from ftqp.core.checks import FloatArray

CONSTANT = 1e-9
"""Spread of values below which a joint stands still [rad or m]."""

NEAR_BEST = 2.0 * STEP**2
"""A turning point so far from the best sample may still be the extreme one [rad or m]."""


def extremes(study: GoalStudy, q: FloatArray, i: int, *, closed: bool) -> tuple[float, float]:
    """The range of joint i on a curve: where its null vector has a zero, n_i = 0, or at an end.

    Args:
        study: Of the goal.
        q: Points of the curve, (k, nv) [rad or m].
        i: Index of the joint.
        closed: Whether the curve goes on from its last point to its first.
    """
    values = q[:, i]
    low, high = float(values.min()), float(values.max())
    if high - low < CONSTANT:
        middle = 0.5 * (low + high)
        return middle, middle
    return -_largest(study, q, i, -1.0, closed), _largest(study, q, i, 1.0, closed)


def _largest(study: GoalStudy, q: FloatArray, i: int, sign: float, closed: bool) -> float:
    """The largest value of sign q_i."""
    values = sign * q[:, i]
    best = float(values.max())
    last = len(q) - 1
    for k in np.flatnonzero(values >= best - NEAR_BEST):
        if not closed and k in (0, last):
            continue
        around = q[[k - 1, k, (k + 1) % len(q)]]
        before, here, after = sign * around[:, i]
        if here < before or here < after:
            continue
        best = max(best, sign * _turning_point(study, around, i))
    return best


def _turning_point(study: GoalStudy, around: FloatArray, i: int) -> float:
    """The value of joint i where it turns round, between the first and the last of three points."""
    direction = around[2] - around[0]

    def rate(share: float) -> float:
        J = _on_curve(study, around, share)[1]
        null = np.linalg.svd(J)[2][-1]
        return float(null[i] * np.sign(null @ direction))

    ends = rate(0.0), rate(2.0)
    if ends[0] * ends[1] > 0.0:  # an inflection, or a turning point at a sample
        return float(around[1, i])
    return float(_on_curve(study, around, brentq(rate, 0.0, 2.0, xtol=1e-10))[0][i])


def _on_curve(study: GoalStudy, around: FloatArray, share: float) -> tuple[FloatArray, FloatArray]:
    """The point of the curve beside a polygon of three, and J there."""
    k = min(int(share), 1)
    rough = around[k] + (share - k) * (around[k + 1] - around[k])
    q, _, _ = study.free.solutions(rough[None], near=True)
    return q[0], study.free.values(q)[1][0]
