"""All self-motions of an arm at a pose, and the pieces of them within joint limits."""

from dataclasses import dataclass
from itertools import islice, product
from typing import Any, final

import numpy as np
from scipy.optimize import brentq, minimize_scalar
from scipy.spatial import cKDTree

from ftqp.analysis.circular_intervals import TURN, CircularIntervals, wrapped
from ftqp.analysis.goals import STEP, GoalStudy, goal_study
from ftqp.analysis.manifolds.scanned_range import scanned_range
from ftqp.core.checks import FloatArray, IntArray, frozen
from ftqp.core.errors import InputError
from ftqp.kernel.entry.study_session import TracedCurve
from ftqp.kernel.layout.enums import CurveEnd
from ftqp.model.robot import Robot

MOST_COPIES = 64
"""Copies of a configuration, by full turns of its joints, that are looked at."""


def limited_curves(study: GoalStudy, curves: list[TracedCurve]) -> list[TracedCurve]:
    """All pieces within the robot's limits of curves that were traced without them."""
    pieces: list[TracedCurve] = []
    for curve in curves:
        copies = [copy for point in _inside(study, curve.q) for copy in _copies(study, point)]
        waiting = np.array(copies).reshape(-1, study.robot.nv)
        for piece in pieces:
            waiting = beside(study, piece.q, waiting)
        while len(waiting):
            piece = study.limited.curve(waiting[0])
            waiting = waiting[1:]
            if len(piece.q) > 1:
                pieces.append(piece)
                waiting = beside(study, piece.q, waiting)
    return pieces


def _excess(study: GoalStudy, q: FloatArray) -> FloatArray:
    """How far the worst joint is outside its limits, whole turns left out, (k,); negative inside."""
    limits = study.robot.limits
    finite = np.isfinite(limits.q_min) & np.isfinite(limits.q_max)
    low, high = np.where(finite, limits.q_min, 0.0), np.where(finite, limits.q_max, 0.0)
    half = np.where(finite, 0.5 * (high - low), np.inf)
    away = q - 0.5 * (low + high)
    turns = ~study.robot.chain.prismatic & finite
    away = np.where(turns, wrapped(away), away)
    one_sided = np.maximum(limits.q_min - q, q - limits.q_max)
    return np.asarray(np.where(finite, np.abs(away) - half, one_sided).max(axis=1))


def _inside(study: GoalStudy, q: FloatArray) -> FloatArray:
    """Points of a curve inside the limits: those of its samples, and ones of pieces between samples."""
    excess = _excess(study, q)
    found = [q[excess <= 0.0]]
    for k in range(1, len(q) - 1):
        if 0.0 < excess[k] < STEP and excess[k] <= min(excess[k - 1], excess[k + 1]):
            ends = q[k - 1], q[k + 1]

            def between(share: float, ends: tuple[FloatArray, FloatArray] = ends) -> FloatArray:
                return study.free.solutions((ends[0] + share * (ends[1] - ends[0]))[None], near=True)[0]

            best = minimize_scalar(
                lambda share, between=between: float(_excess(study, between(share))[0]),
                bounds=(0.0, 1.0),
                method="bounded",
            )
            if best.fun < 0.0:
                found.append(between(float(best.x)))
    return np.vstack(found)


def _copies(study: GoalStudy, q: FloatArray) -> list[FloatArray]:
    """The configuration with whole turns added, wherever the limits allow it."""
    limits, choices = study.robot.limits, []
    for i, value in enumerate(q):
        if study.turning[i] or study.robot.chain.prismatic[i]:
            choices.append([value])
            continue
        first = np.ceil((limits.q_min[i] - value) / TURN)
        last = np.floor((limits.q_max[i] - value) / TURN)
        if not np.isfinite(first + last):
            first = last = 0.0
        choices.append([value + TURN * k for k in np.arange(first, last + 1.0)])
    return [np.array(copy) for copy in islice(product(*choices), MOST_COPIES)]


def beside(study: GoalStudy, known: FloatArray, q: FloatArray, reach: float = 2.0 * STEP) -> FloatArray:
    """The configurations that are farther than a reach from all known ones, (k, nv) [rad or m]."""
    tree = cKDTree(turned(study, known), boxsize=np.where(study.turning, TURN, 0.0))
    away, _ = tree.query(turned(study, q), distance_upper_bound=reach)
    return np.asarray(q[~np.isfinite(away)])


def turned(study: GoalStudy, q: FloatArray) -> FloatArray:
    """Configurations with the values of joints without limits in [0, 2 pi)."""
    values = np.mod(q, TURN)
    return np.asarray(np.where(study.turning, np.where(values >= TURN, 0.0, values), q))


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


STARTS = 2048
"""Starts from which solutions are looked for at most."""

QUIET = 100
"""The search for components ends when so many solutions in a row lay on known ones."""

POINT = 1e-4
"""A curve that does not close and is shorter is a point [rad or m]."""

SAMPLES = 512
"""Solutions that are looked for where self-motions are no curves."""


def self_motion(robot: Robot, pose: Any, rows: Any = "pose") -> list[Manifold]:
    """All self-motions at a pose: the configurations that keep the task rows there, one list entry each.

    With one joint more than task rows they are curves, traced to 1e-12: closed ones, or pieces between joint
    limits. Components are found from 2048 quasi-random starts, until 100 solutions in a row lay on known
    curves. With more joints there is one entry of up to 512 samples, and components are not told apart.
    Source: goel2005; docs/theory/unidentified-failures.md, "Self-motions".

    Args:
        robot: The arm.
        pose: The goal: a pose (4, 4), or a point (2,) or (3,) where no rotation counts [m].
        rows: ``"pose"`` or ``"position"``, which are those of the robot's own rows, or names of rows.

    Raises:
        InputError: The goal does not fit the rows or is outside the workspace, or no joint is to spare.
    """
    study = goal_study(robot, pose, rows)
    if study.redundancy < 1:
        raise InputError(
            f"{robot.name} has {robot.nv} joints and the task {study.m} rows, so it has no self-motion; "
            "expected at least one joint more than rows"
        )
    if study.redundancy == 1:
        return [manifold_of(study, curve) for curve in traced_curves(study)]
    return [manifold_of_samples(study, samples(study))]


def traced_curves(study: GoalStudy) -> list[TracedCurve]:
    """The self-motions of a goal of an arm with one joint to spare, as they were traced."""
    found = study.free.self_motions(study.starts(STARTS), quiet=QUIET)
    curves = [curve for curve in found if curve.end is CurveEnd.CLOSED or curve.length > POINT]
    if not curves:
        _, errors, _ = study.free.solutions(study.starts(256))
        if errors.min() > study.tolerance:
            raise study.unreachable(float(errors.min()))
        raise InputError(
            f"the goal is at the edge of the workspace of {study.robot.name}, where its self-motion is a "
            "point; expected a goal inside"
        )
    if study.has_limits:
        curves = limited_curves(study, curves)
        if not curves:
            raise InputError(
                f"the goal is reached by {study.robot.name} only outside its joint limits; "
                "expected a goal inside the workspace"
            )
    return curves


def samples(study: GoalStudy) -> FloatArray:
    """Solutions of a goal inside the joint limits, from evenly spread starts, (k, nv) [rad or m]."""
    q, errors, _ = study.limited.solutions(study.starts(SAMPLES, limited=True), bounded=True)
    done = errors <= study.tolerance
    if not done.any():
        raise study.unreachable(float(errors.min()))
    return np.asarray(q[done])
