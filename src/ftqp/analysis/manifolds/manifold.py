"""One self-motion of an arm: all configurations that reach a pose and hang together."""

from dataclasses import dataclass
from typing import final

import numpy as np

from ftqp.analysis.circular_intervals import TURN, CircularIntervals
from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.manifolds.curve_extremes import extremes
from ftqp.analysis.manifolds.scanned_range import scanned_range
from ftqp.core.checks import FloatArray, IntArray, frozen
from ftqp.kernel.entry.study_session import TracedCurve
from ftqp.kernel.layout.method_codes import CurveEnd

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
    """Samples of self-motions of dimension 2 and more, in one.

    Args:
        study: Of the goal.
        q: Solutions, (k, nv) [rad or m].
    """
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
