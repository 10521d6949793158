"""One self-motion of an arm: all configurations that reach a pose and hang together."""

from dataclasses import dataclass
from typing import final

import numpy as np
from scipy.optimize import brentq

from ftqp.analysis.circular_intervals import TURN, CircularIntervals
from ftqp.analysis.goals import STEP, GoalStudy
from ftqp.analysis.manifolds.scanned_range import scanned_range
from ftqp.core.checks import FloatArray, IntArray, frozen
from ftqp.kernel.entry.study_session import TracedCurve
from ftqp.kernel.layout.method_codes import CurveEnd

CONSTANT = 1e-9
"""Spread of values below which a joint stands still [rad or m]."""

NEAR_BEST = 2.0 * STEP**2
"""A turning point so far from the best sample may still be the extreme one [rad or m]."""


def extremes(study: GoalStudy, q: FloatArray, i: int, *, closed: bool) -> tuple[float, float]:
    """The range of joint i on a curve: where its null vector has a zero, n_i = 0, or at an end."""
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


NEARLY_SINGULAR = 1e-6
"""Smallest singular value [m] below which a self-motion counts as singular."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Manifold:
    """A self-motion; a curve where the arm has one joint more than task rows.

    Attributes:
        q: Points of it, unwrapped along a curve, (k, nv) [rad or m].
        dimension: r = nv - m; from 2 on the points are samples.
        closed: Whether a curve comes back to its start; else it ends at joint limits.
        length: Arc length of a curve [rad or m], sliding joints counting as they are; nan of samples.
        winding: Full turns of each joint on one round of a closed curve, (nv,).
        singular: Whether it passes a singularity or crosses itself there.
        connected: Whether its points are known to hang together. Samples of dimension 2 and more are not
            told apart by components: then all are in one, and False says so.
    """

    q: FloatArray
    dimension: int
    closed: bool
    length: float
    winding: IntArray
    singular: bool
    connected: bool
    _study: GoalStudy
    _parts: FloatArray

    def ranges(self) -> dict[str, CircularIntervals]:
        """The values that each joint takes, by joint name; where it stands for all samples, on all of them.

        Source: docs/theory/unidentified-failures.md, "Ranges of joints".
        """
        study = self._study
        if not self.connected:
            return {joint: scanned_range(study, i, self.q) for i, joint in enumerate(study.robot.joints)}
        return {
            joint: CircularIntervals.of([self._span(i)], circular=bool(turns))
            for i, (joint, turns) in enumerate(zip(study.robot.joints, study.turning, strict=True))
        }

    def spread(self, count: int) -> FloatArray:
        """So many points at equal arc lengths, (count, nv) [rad or m]; the ends of an open curve included.

        Args:
            count: How many, at least 2; of samples those that there are.
        """
        if not self.connected:
            return self.q[:count].copy()
        q, parts = self.q, self._parts[1:]
        if self.closed:
            q = np.vstack([q, q[0] + TURN * self.winding])
            parts = np.append(parts, self._parts[0])
        arcs = np.concatenate([[0.0], np.cumsum(parts)])
        wanted = (
            np.linspace(0.0, arcs[-1], count + 1)[:-1] if self.closed else np.linspace(0, arcs[-1], count)
        )
        rough = np.column_stack([np.interp(wanted, arcs, column) for column in q.T])
        exact, _, _ = self._study.free.solutions(rough, near=True)
        return exact

    def _span(self, i: int) -> tuple[float, float]:
        """The values of joint i on a curve, from the smallest to the largest."""
        if self.winding[i]:
            return -np.pi, np.pi
        return extremes(self._study, self.q, i, closed=self.closed)


def manifold_of(study: GoalStudy, curve: TracedCurve) -> Manifold:
    """The self-motion that was traced."""
    return Manifold(
        q=frozen(curve.q),
        dimension=1,
        closed=curve.end is CurveEnd.CLOSED,
        length=curve.length,
        winding=frozen(curve.winding),
        singular=curve.crossed or curve.least < NEARLY_SINGULAR,
        connected=True,
        _study=study,
        _parts=frozen(curve.parts),
    )


def manifold_of_samples(study: GoalStudy, q: FloatArray) -> Manifold:
    """Samples of self-motions of dimension 2 and more, in one."""
    return Manifold(
        q=frozen(q),
        dimension=study.redundancy,
        closed=False,
        length=float("nan"),
        winding=frozen(np.zeros(study.robot.nv, dtype=np.int64)),
        singular=False,
        connected=False,
        _study=study,
        _parts=frozen(np.empty(0)),
    )
