"""Rests off the goal, at one locked value and as curves over all, and where they change their kind."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from ftqp.analysis.circular_intervals import TURN, CircularIntervals, wrapped
from ftqp.analysis.goals import GoalStudy, goal_study
from ftqp.analysis.outcomes.unaware_law import weights_inverse
from ftqp.analysis.rest.linearisation import (
    RestKind,
    eigenvalues_at,
    is_neutral,
    kind_by_signs,
    kind_of,
    weighted_inverse,
)
from ftqp.analysis.rest.rest_tracing import STEP, RestEquations, RestTracer, TracedRests
from ftqp.core.checks import BoolArray, FloatArray, frozen
from ftqp.core.errors import InputError
from ftqp.model.robot import Robot

SAME = 1e-5
"""Configurations nearer than this are one [rad or m]."""


def distinct(q: FloatArray, turns: BoolArray) -> FloatArray:
    """One of each set of configurations that are the same up to whole turns, (k, n) [rad or m]."""
    kept: list[FloatArray] = []
    for one in q:
        if all(np.abs(np.where(turns, wrapped(d), d)).max() > SAME for d in (one - other for other in kept)):
            kept.append(one)
    return np.array(kept).reshape(-1, len(turns))


STARTS_OF_RESTS = 512
"""From which rests are looked for: planar arms of three joints and random goals have none that they miss."""
AT_GOAL = 1e-7
"""Error below which a configuration is at the goal, no rest off it [m]."""
SINGULAR = 1e-9
"""det(A A') by sigma_max^2m below which a configuration is singular."""
RESTING = 1e-7
"""Share of the command to moving joints that counts as none."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RestConfiguration:
    """A configuration at which the arm rests off its goal, commanding the locked joint alone.

    Attributes:
        q: The configuration, (nv,) [rad or m].
        error: |e| there [m], angular rows times the characteristic length.
        alpha: What of the error goes along the locked joint's column, e = alpha a_i [rad or m].
        eigenvalues: Of the linearisation over the other joints, (nv - 1,) [1/s at a gain of 1/s]. Joints that
            never move the task rows are left out; they stand at their neutral values.
        kind: ``sink``, ``saddle``, ``source`` or ``degenerate``, by all eigenvalues.
    """

    q: FloatArray
    error: float
    alpha: float
    eigenvalues: NDArray[np.complex128]
    kind: RestKind


def rest_configurations(
    robot: Robot, goal: Any, joint: str | int, value: float, W: Any = None, rows: Any = "position"
) -> list[RestConfiguration]:
    """Where the arm can come to rest off its goal with a joint locked at a value that nobody knows of.

    What 512 quasi-random starts find: of planar arms of three joints all that a search on a fine grid finds,
    of other arms most, but not certainly all. Rests outside joint limits are left out.
    Source: goel2005; docs/theory/unidentified-failures.md, "Rest".

    Args:
        robot: The arm.
        goal: A pose (4, 4), or a point (2,) or (3,) where no rotation counts [m]; it may be out of reach.
        joint: Name or 0-based index of the locked joint.
        value: Where it is locked [rad or m].
        W: Weights of the joint rates, symmetric positive definite (nv, nv), or their diagonal; None is 1.
        rows: ``"pose"`` or ``"position"``, which are those of the robot's own rows, or names of rows.

    Raises:
        InputError: W is not positive definite, the joint is unknown, the value is not finite, the goal does
            not fit the rows, or the arm has no joint to spare.
    """
    study, M, i = rest_study(robot, goal, joint, W, rows)
    if not np.isfinite(value):
        raise InputError(f"value is {value}, expected a finite position of {robot.joints[i]}")
    q = rests_at(study, M, i, float(value))
    return [described(study, M, i, one) for one in q[inside_limits(study, q, i)]]


def rests_at(study: GoalStudy, M: FloatArray, i: int, value: float) -> FloatArray:
    """Regular rests off the goal with joint i locked at a value, each once, wherever limits are, (k, n)."""
    equations = RestEquations(study, M, i)
    starts = study.starts(STARTS_OF_RESTS)
    starts[:, i] = value
    z, done = equations.solved(equations.started(starts), held=True)
    return distinct(_regular(study, M, i, z[done][:, : study.robot.nv]), ~study.robot.chain.prismatic)


def rest_study(
    robot: Robot, goal: Any, joint: str | int, W: Any, rows: Any
) -> tuple[GoalStudy, FloatArray, int]:
    """The study of a goal, W^-1 and the index of the locked joint, checked; see ``rest_configurations``."""
    study = goal_study(robot, goal, rows)
    i, M = robot.joint(joint), weights_inverse(W, robot.nv)
    if study.redundancy < 1:
        raise InputError(
            f"{robot.name} has {robot.nv} joints and the task {study.m} rows, so a locked joint leaves too "
            "few; expected at least one joint more than rows"
        )
    return study, M, i


def described(study: GoalStudy, M: FloatArray, i: int, q: FloatArray) -> RestConfiguration:
    """What there is to say of a rest."""
    e, A, _, _ = study.free.values(q[None])
    a = A[0, :, i]
    eigenvalues = eigenvalues_at(study, M, q[None], i)[0]
    return RestConfiguration(
        q=frozen(q.copy()),
        error=float(np.linalg.norm(e[0])),
        alpha=float(a @ e[0] / (a @ a)),
        eigenvalues=eigenvalues[np.argsort(eigenvalues.real)],
        kind=kind_of(eigenvalues),
    )


def inside_limits(study: GoalStudy, q: FloatArray, but: int | None = None) -> BoolArray:
    """Which configurations are within the limits of the joints, up to whole turns, (k,)."""
    limits, slides = study.robot.limits, study.robot.chain.prismatic
    both = np.isfinite(limits.q_min) & np.isfinite(limits.q_max)
    low, high = np.where(both, limits.q_min, 0.0), np.where(both, limits.q_max, 0.0)
    turned = np.mod(q - low, TURN) <= high - low
    within = (q >= limits.q_min) & (q <= limits.q_max)
    inside = np.where(slides | ~both, within, turned)
    if but is not None:
        inside[:, but] = True
    return np.asarray(inside.all(axis=1))


def _regular(study: GoalStudy, M: FloatArray, i: int, q: FloatArray) -> FloatArray:
    """Those of some configurations that are off the goal, regular, and command joint i alone, (k, n)."""
    e, A, _, _ = study.free.values(q)
    sigma = np.linalg.svd(A, compute_uv=False)
    regular = (sigma**2).prod(axis=1) > SINGULAR * sigma[:, 0] ** (2 * study.m)
    regular &= np.linalg.norm(e, axis=1) > AT_GOAL
    q, e, A = q[regular], e[regular], A[regular]
    command = (weighted_inverse(A, M) @ e[:, :, None])[:, :, 0]
    others = np.delete(command, i, axis=1)
    return np.asarray(q[np.linalg.norm(others, axis=1) < RESTING * np.linalg.norm(command, axis=1)])


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
        """Where the kind changes for more than ``ROUNDING``: point before, place, kinds before and behind."""
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
