"""All rests off the goal as curves over the locked value, and where they change their kind."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from ftqp.analysis.circular_intervals import TURN, CircularIntervals
from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.rest.linearisation import RestKind, eigenvalues_at, is_neutral, kind_by_signs
from ftqp.analysis.rest.rest_configurations import inside_limits, rest_study
from ftqp.analysis.rest.rest_tracing import STEP, RestEquations, RestTracer, TracedRests
from ftqp.core.checks import FloatArray, frozen
from ftqp.model.robot import Robot

STARTS = 1024
"""Starts of curves."""
NO_ERROR = 1e-6
"""Share of the error below which a solution is none, but a joint that does not move the tip."""
HALVINGS = 44
"""Halvings of the piece of a curve in which a kind changes."""
ROUNDING = 1e-3
"""A kind that lasts no longer along a curve is rounding beside a singularity [rad or m]."""
COPIES = 3
"""Whole turns by which values of a joint with limits are looked for within them, each way."""
MOSTLY = 0.5
"""Share of points with a zero eigenvalue from which a curve counts as degenerate."""
CHANGES = 4
"""Changes of kind between two neighbouring points of a curve at most."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KindChange:
    """Where a curve of rests changes its kind.

    Attributes:
        value: The locked joint's value there, unwrapped along the curve [rad or m].
        q: The configuration, (nv,) [rad or m].
        before: The kind on the way there.
        after: The kind on the way on.
    """

    value: float
    q: FloatArray
    before: RestKind
    after: RestKind


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RestCurve:
    """A curve of rests off the goal.

    Attributes:
        q: Its points, unwrapped, (k, nv); of a closed curve the last is the first again [rad or m].
        error: |e| at each, (k,) [m]; 0 where the curve passes the goal.
        kinds: The kind at each, (k,) of ``RestKind``.
        closed: Whether it comes back to its start.
        changes: Where its kind changes, in the order of the curve.
        branches: Configurations at which another curve crosses it, flagged and not followed, (b, nv).
    """

    q: FloatArray
    error: FloatArray
    kinds: tuple[RestKind, ...]
    closed: bool
    changes: tuple[KindChange, ...]
    branches: FloatArray


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RestCurves:
    """All curves of rests that were found for one joint.

    Attributes:
        joints: The names of all joints.
        index: The 0-based index of the locked joint.
        curves: The curves.
    """

    joints: tuple[str, ...]
    index: int
    curves: tuple[RestCurve, ...]
    _study: GoalStudy

    @property
    def joint(self) -> str:
        """The name of the locked joint."""
        return self.joints[self.index]

    def __iter__(self) -> Iterator[RestCurve]:
        return iter(self.curves)

    def __len__(self) -> int:
        return len(self.curves)

    @property
    def changes(self) -> tuple[KindChange, ...]:
        """Where kinds change, curve by curve."""
        return tuple(change for curve in self.curves for change in curve.changes)

    def sink_intervals(self) -> CircularIntervals:
        """The locked values for which a sink is known: from there the arm may come to rest off its goal.

        Ends are exact, but at e = 0, where they coincide with the ends of ``joint_ranges``.
        """
        return self.intervals(RestKind.SINK)

    def intervals(self, *kinds: RestKind) -> CircularIntervals:
        """The locked values for which a rest of some kinds is known; without kinds, any rest within limits.

        Args:
            kinds: The kinds that count.
        """
        wanted = set(kinds) if kinds else set(RestKind) - {RestKind.OUTSIDE}
        pairs = [pair for curve in self.curves for pair in self._spans(curve, wanted)]
        i, robot = self.index, self._study.robot
        if self._study.turning[i]:
            return CircularIntervals.of(pairs)
        turns = np.zeros(1) if robot.chain.prismatic[i] else TURN * np.arange(-COPIES, COPIES + 1)
        low, high = robot.limits.q_min[i], robot.limits.q_max[i]
        copies = [(max(a + turn, low), min(b + turn, high)) for a, b in pairs for turn in turns]
        return CircularIntervals.of([pair for pair in copies if pair[0] <= pair[1]], circular=False)

    def _spans(self, curve: RestCurve, wanted: set[RestKind]) -> list[tuple[float, float]]:
        """The locked values of each stretch of a curve whose kind is wanted."""
        values = curve.q[:, self.index]
        spans: list[list[float]] = []
        on = False
        for value, kind in zip(values, curve.kinds, strict=True):
            if kind in wanted:
                if not on:
                    spans.append([])
                spans[-1].append(float(value))
            on = kind in wanted
        return [(min(span), max(span)) for span in spans]


def rest_curves(
    robot: Robot, goal: Any, joint: str | int, W: Any = None, rows: Any = "position"
) -> RestCurves:
    """All rests of the arm off its goal, over all values at which a joint may lock with nobody knowing.

    They are curves for every number of joints and rows. Each is traced by predictor and corrector, also where
    J is singular, and its kind is that of all eigenvalues; changes are halved to rounding. Curves start from
    1024 quasi-random configurations within the limits; those that lie outside the limits all along are left
    out. With a pose, a curve ends where the rotation that is left is half a turn, and with a joint that
    slides where that leaves its limits, or ten times the arm's reach.
    Source: goel2005; docs/theory/unidentified-failures.md, "Rest".

    Args:
        robot: The arm.
        goal: A pose (4, 4), or a point (2,) or (3,) where no rotation counts [m]; it may be out of reach.
        joint: Name or 0-based index of the locked joint.
        W: Weights of the joint rates, symmetric positive definite (nv, nv), or their diagonal; None is 1.
        rows: ``"pose"`` or ``"position"``, which are those of the robot's own rows, or names of rows.

    Raises:
        InputError: W is not positive definite, the joint is unknown, the goal does not fit the rows, or the
            arm has no joint to spare.
    """
    study, M, i = rest_study(robot, goal, joint, W, rows)
    equations = RestEquations(study, M, i)
    tracer = RestTracer(equations)
    traced: list[TracedRests] = []
    for start in _seeds(study, M, i, equations):
        if any(tracer.distances(curve.z, start[: robot.nv]).min() < 2.0 * STEP for curve in traced):
            continue
        curve = tracer.trace(start)
        if curve is not None and len(curve.z) > 2:
            traced.append(curve)
    labelled = [_Labelled(study, M, i, tracer).curve(one) for one in traced]
    inside = tuple(curve for curve in labelled if any(kind is not RestKind.OUTSIDE for kind in curve.kinds))
    return RestCurves(joints=robot.joints, index=i, curves=inside, _study=study)


def _seeds(study: GoalStudy, M: FloatArray, i: int, equations: RestEquations) -> FloatArray:
    """Rests within limits to start from, (k, n + m + 3)."""
    starts = study.starts(STARTS, limited=True)
    z, done = equations.solved(equations.started(starts), held=False)
    z = z[done & (np.abs(z[:, -1]) > NO_ERROR)]
    return np.asarray(z[inside_limits(study, z[:, : study.robot.nv])])


@final
class _Labelled:
    """Names the kinds along traced curves."""

    def __init__(self, study: GoalStudy, M: FloatArray, i: int, tracer: RestTracer) -> None:
        self._study, self._M, self._i, self._tracer = study, M, i, tracer
        self._n = study.robot.nv
        self._degenerate = False

    def curve(self, traced: TracedRests) -> RestCurve:
        """The curve with its kinds, and their changes as points of it."""
        z = traced.z
        everywhere = eigenvalues_at(self._study, self._M, z[:, : self._n], self._i)
        self._degenerate = float(np.mean([is_neutral(values) for values in everywhere])) > MOSTLY
        kinds = self._kinds(z)
        points, labels, changes = [z[0]], [kinds[0]], list[KindChange]()
        for k, there, before, after in self._changes(z, kinds):
            known = len(points) - 2 * len(changes)
            points += [*z[known : k + 1], there, there]
            labels += [before] * (k + 1 - known) + [before, after]
            q_there = frozen(there[: self._n].copy())
            changes.append(KindChange(value=float(there[self._i]), q=q_there, before=before, after=after))
        known = len(points) - 2 * len(changes)
        points += list(z[known:])
        labels += [labels[-1]] * (len(z) - known)
        q = np.array(points)[:, : self._n]
        return RestCurve(
            q=frozen(q),
            error=frozen(np.linalg.norm(self._study.free.values(q)[0], axis=1)),
            kinds=tuple(labels),
            closed=traced.closed,
            changes=tuple(changes),
            branches=frozen(z[list(traced.branches), : self._n].copy()),
        )

    def _kinds(self, z: FloatArray) -> list[RestKind]:
        q = z[:, : self._n]
        eigenvalues = eigenvalues_at(self._study, self._M, q, self._i)
        inside = inside_limits(self._study, q)
        kinds = [RestKind.DEGENERATE if self._degenerate else kind_by_signs(v) for v in eigenvalues]
        return [kind if here else RestKind.OUTSIDE for kind, here in zip(kinds, inside, strict=True)]

    def _changes(
        self, z: FloatArray, kinds: list[RestKind]
    ) -> list[tuple[int, FloatArray, RestKind, RestKind]]:
        """Where the kind changes: the point of the curve before, the place, the kinds before and behind it.

        Changes back within ``ROUNDING`` are left out: beside singularities kinds are lost in rounding.
        """
        arcs = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(z[:, : self._n], axis=0), axis=1))])
        found: list[tuple[int, FloatArray, RestKind, RestKind]] = []
        where: list[float] = []
        for k in range(len(z) - 1):
            for there, before, after in self._between(z[k], z[k + 1], kinds[k], kinds[k + 1]):
                arc = float(arcs[k] + np.linalg.norm((there - z[k])[: self._n]))
                if where and arc - where[-1] < ROUNDING:
                    first, place, before, _ = found.pop()
                    where[-1] = arc
                    if before is after:
                        where.pop()
                    else:
                        found.append((first, place, before, after))
                else:
                    found.append((k, there, before, after))
                    where.append(arc)
        return found

    def _between(
        self, one: FloatArray, other: FloatArray, first: RestKind, last: RestKind
    ) -> list[tuple[FloatArray, RestKind, RestKind]]:
        """The changes of kind between two neighbouring points, each with what is before and behind it."""
        found: list[tuple[FloatArray, RestKind, RestKind]] = []
        begin, kind = 0.0, first
        while kind is not last and len(found) < CHANGES:
            low, high = begin, 1.0
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                if self._kinds(self._tracer.between(one, other, middle)[None])[0] is kind:
                    low = middle
                else:
                    high = middle
            there = self._tracer.between(one, other, high)
            after = self._kinds(there[None])[0]
            found.append((there, kind, after))
            if high >= 1.0:
                break
            begin, kind = high, after
        return found
