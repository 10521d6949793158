"""What a motion survives: the report of ``ftqp.analysis.coverage``, and what it is worth to a mission."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, final

import numpy as np

from ftqp.analysis.survival.failure_instants import Pairs
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.analysis.survival.way_round import way_round
from ftqp.core.checks import BoolArray, FloatArray, IntArray, positive
from ftqp.core.errors import FtqpError, InputError, unknown
from ftqp.core.picture import painted
from ftqp.core.small_picture import html_table, strips_svg
from ftqp.faults.kinds import Degraded, Locked
from ftqp.kernel.layout.enums import Survival
from ftqp.model.robot import Robot

HOUR = 3600.0
"""[s]"""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MissionSurvival:
    """How probably one run of a task is finished although joints may fail.

    Attributes:
        low: At least this: between instants the worse neighbour counts, and no second failure is survived.
        likely: Between both.
        high: At most this: the better neighbour counts, and second failures do no harm.
        without: The probability that the task is finished where no failure is survived at all.
        coverage: The share of failures that is survived, weighted by their rates.
    """

    low: float
    likely: float
    high: float
    without: float
    coverage: float


def mission_survival(
    robot: Robot, survived: BoolArray, t: FloatArray, end: float, mtbf: Mapping[str | int, float]
) -> MissionSurvival:
    """The probability that a task is finished; joints fail with constant rates, each for itself.

    With lambda_j = 1/mtbf_j, L their sum and S_j(t) whether a failure at t is survived:

        P = exp(-L T) + sum_j  integral_0^T lambda_j exp(-L t) S_j(t) exp(-c (L - lambda_j)(T - t)) dt,

    c = 1 where every second failure ends the task, 0 where none does.
    """
    rates = np.zeros(robot.nv)
    for joint, hours in mtbf.items():
        if isinstance(joint, str) and joint not in robot.joints:
            raise unknown("joint", joint, robot.name, robot.joints)
        rates[robot.joint(joint)] = 1.0 / (HOUR * positive(f"mtbf of {joint!r}", hours, "h"))
    total = float(rates.sum())
    if not total > 0.0:
        raise InputError("mtbf is empty, expected the mean time between failures of a joint at least [h]")
    edges = np.append(t, end)
    later = np.concatenate([survived[:, 1:], survived[:, -1:]], axis=1)
    shares = {"low": survived & later, "high": survived | later}
    without = float(np.exp(-total * end))

    def finished(inside: FloatArray, second: bool) -> float:
        """P with S constant between instants: the integral of each piece in closed form."""
        chance = without
        for j, rate in enumerate(rates):
            others = total - rate if second else 0.0
            slope = total - others  # of the exponent -L t - others (T - t)
            pieces = -np.expm1(-slope * np.diff(edges)) / slope if slope > 0.0 else np.diff(edges)
            chance += float(
                rate * np.exp(-others * end) * (inside[j] * np.exp(-slope * edges[:-1]) * pieces).sum()
            )
        return chance

    both = [shares[name].astype(np.float64) for name in ("low", "high")]
    mean = 0.5 * (both[0] + both[1])
    low, high = finished(both[0], True), min(1.0, finished(both[1], False))
    likely = 0.5 * (finished(mean, True) + finished(mean, False))
    covered = float((mean * np.diff(edges)).sum(axis=1) @ rates / (total * end))
    return MissionSurvival(low=low, likely=likely, high=high, without=without, coverage=covered)


class NotSurvived(FtqpError):
    """A joint fails at an instant behind which the path cannot be finished.

    Attributes:
        joint: Name of the joint, or of both with a plus sign.
        time: When it fails [s].
        until: Until when the path can be followed [s].
        reason: How the continuation ends.
        q: Configurations of the samples from the failure until then, (K, nv) [rad or m].
        errors: The largest errors of position and rotation of the best effort to the end of the path [m,
            rad]; None where it was not looked for.
    """

    def __init__(
        self,
        *,
        joint: str,
        time: float,
        until: float,
        reason: Survival,
        q: FloatArray,
        errors: tuple[float, float] | None = None,
        looked: str | None = None,
    ) -> None:
        self.joint, self.time, self.until, self.reason, self.q = joint, time, until, reason, q
        self.errors = errors
        best = "" if errors is None else "; the best effort to its end is off by {:.3g} m and {:.3g} rad"
        super().__init__(
            f"the path cannot be finished when {joint!r} locks at t = {time:g} s ({reason.name}); it can be "
            f"followed until t = {until:g} s"
            + best.format(*(errors or ()))
            + ("" if looked is None else f"; of its end {looked}")
        )


SENTENCES: Final = {
    Survival.SURVIVED: "The other joints finish the path.",
    Survival.LIMIT: "A joint meets its position limit.",
    Survival.VELOCITY: "The path can be followed, but a joint would have to be faster than its limit.",
    Survival.SINGULAR: "The remaining joints become singular.",
    Survival.SINGULAR_VELOCITY: "The remaining joints become singular; a speed limit is met first.",
    Survival.NOT_CONVERGED: "No solution is found for the remaining joints.",
    Survival.NOMINAL: "The motion itself is outside its limits at the failure.",
    Survival.ERROR: "The error leaves its tolerance.",
    Survival.STRUCTURAL: "This task can never do without the joint.",
    Survival.TOO_NEAR: "The arm comes too near to something, or to itself.",
}
"""What each verdict says."""
CLOSE: Final = 0.01
"""So near a position limit a verdict is not clear [rad or m]."""
HURRIED: Final = 0.98
"""From this share of a speed limit on a verdict is not clear."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class CoverageReport:
    """Which failures of a motion are survived; made by ``ftqp.analysis.coverage``.

    Failures are joints, or sets that fail together, in the order of ``failures``; K instants are verified.

    Attributes:
        task: The path, and the rows of it that are to be kept after a failure.
        q: The motion, (N + 1, nv) [rad or m].
        samples: The verified samples, (K,).
        failures: The joints of each failure, by index.
        status: A ``Survival`` for each failure and instant, (failures, K).
        position: Largest errors of position until the end, or until it is lost, (failures, K) [m].
        rotation: The same of rotation, (failures, K) [rad].
        margin: Least distance of a joint that moves from its limits, (failures, K) [rad or m].
        hurry: Largest share of a speed limit, (failures, K).
        clearance: Least distance of two bodies that are to be kept apart until the end, or until it is lost,
            (failures, K) [m]; inf where none are.
        jump: Length of the jump of the joint velocities that an instant lock asks for, (failures, K) [rad/s].
        manipulability: Relative manipulability without each failure's joints at all samples, (N + 1,
            failures); with one joint to spare and single joints it has the sign of the null vector.
        structural: Names of the joints that this task can never do without.
        upper_bound: How many joints any posture found at some samples can do without, (waypoints,), or None
            where it was not asked for.
        waypoints: The samples of the upper bound, (waypoints,).
        fault: How joints fail: ``locked``, ``degraded`` or ``free_swinging``.
        lock: ``instant``, or ``ramp`` where joints brake first.
        post: ``exact``, ``qp`` or ``planner``: how the remaining joints go on.
        tolerance: Errors of position and rotation within which ``qp`` and ``planner`` survive [m, rad].
    """

    task: TaskPath
    q: FloatArray
    samples: IntArray
    failures: tuple[tuple[int, ...], ...]
    status: IntArray
    position: FloatArray
    rotation: FloatArray
    margin: FloatArray
    hurry: FloatArray
    clearance: FloatArray
    jump: FloatArray
    manipulability: FloatArray
    structural: tuple[str, ...]
    upper_bound: IntArray | None
    waypoints: IntArray
    fault: str
    lock: str
    post: str
    tolerance: tuple[float, float]
    _pairs: Pairs

    def __repr__(self) -> str:
        """What counts most."""
        return (
            f"CoverageReport({self.task.robot.name!r}, coverage={self.coverage:.4f}, "
            f"pairs={self.status.size}, structural={list(self.structural)})"
        )

    def _repr_html_(self) -> str:
        """The share of instants at which each failure is survived, for notebooks."""
        rows = [(name, f"{100.0 * share:.1f} %") for name, share in self.per_joint.items()]
        share = f"{100.0 * self.coverage:.1f} % of {self.status.size}"
        title = f"{self.task.robot.name}: {share} failures are survived"
        says = f"green where a failure is survived, over {float(self.task.t[-1]):g} s"
        return html_table(title, ("failure", "survived"), rows, picture=strips_svg(self.survived, says))

    @property
    def survived(self) -> BoolArray:
        """Which failures are survived, (failures, K)."""
        return np.asarray(self.status == Survival.SURVIVED)

    @property
    def coverage(self) -> float:
        """The share of all pairs of failure and instant that is survived, 0 to 1."""
        return float(self.survived.mean())

    @property
    def t(self) -> FloatArray:
        """The verified instants, (K,) [s]."""
        return np.asarray(self.task.t[self.samples])

    @property
    def names(self) -> tuple[str, ...]:
        """A name for each failure: that of its joint, or of both with a plus sign."""
        joints = self.task.robot.joints
        return tuple("+".join(joints[i] for i in failed) for failed in self.failures)

    @property
    def per_joint(self) -> dict[str, float]:
        """The share of instants at which each failure is survived, by its name."""
        return {name: float(row.mean()) for name, row in zip(self.names, self.survived, strict=True)}

    @property
    def counts(self) -> dict[Survival, int]:
        """How many pairs have each verdict."""
        return {verdict: int((self.status == verdict).sum()) for verdict in Survival}

    @property
    def first_safe(self) -> float | None:
        """The first verified instant from which on every failure is survived [s], or None."""
        lost = np.flatnonzero(~self.survived.all(axis=0))
        first = int(lost[-1]) + 1 if len(lost) else 0
        return float(self.t[first]) if first < len(self.samples) else None

    @property
    def worst_error(self) -> tuple[float, float]:
        """The largest errors of position and rotation of all survived pairs [m, rad]."""
        kept = self.survived
        return float(self.position[kept].max(initial=0.0)), float(self.rotation[kept].max(initial=0.0))

    @property
    def least_margin(self) -> float:
        """The least distance from a position limit of all survived pairs [rad or m]."""
        return float(self.margin[self.survived].min(initial=np.inf))

    @property
    def least_clearance(self) -> float:
        """The least distance of bodies that are to be kept apart, of all survived pairs [m]; inf without."""
        return float(self.clearance[self.survived].min(initial=np.inf))

    @property
    def energy(self) -> float:
        """E = sum |q_(k+1) - q_k|^2 / dt of the motion itself [rad2/s]."""
        return float((np.diff(self.q, axis=0) ** 2).sum() / self.task.dt)

    @property
    def sign_changes(self) -> IntArray:
        """How often the null vector's entry of each joint changes its sign, (failures,); 0 without a sign."""
        return np.asarray((np.diff(np.sign(self.manipulability), axis=0) != 0).sum(axis=0))

    @property
    def least_manipulability(self) -> FloatArray:
        """The least relative manipulability without each failure's joints on the motion, (failures,)."""
        return np.asarray(np.abs(self.manipulability).min(axis=0))

    def jump_quantiles(self) -> tuple[float, float]:
        """Median and 95 % quantile of the velocity jumps, infinite ones included [rad/s]."""
        median, high = np.quantile(self.jump, [0.5, 0.95], method="higher")
        return float(median), float(high)

    def survives(self, joint: str | int, time: float) -> bool:
        """Whether a failure of a joint at a time is survived, at both verified instants next to it.

        Args:
            joint: Its name or index, or a name among ``names``.
            time: From 0 to the end of the path [s].

        Raises:
            InputError: No such failure was verified, or the time is outside the path.
        """
        row = self.survived[self._row(joint)]
        if not 0.0 <= time <= self.task.t[-1]:
            raise InputError(f"time is {time:g} s, expected 0 to {self.task.t[-1]:g} s, the path's duration")
        after = int(np.searchsorted(self.t, time - 1e-9))
        before = after if after < len(row) and abs(self.t[after] - time) <= 1e-9 else max(after - 1, 0)
        return bool(row[before] and row[min(after, len(row) - 1)])

    def best_effort(self) -> tuple[FloatArray, FloatArray]:
        """Largest errors to the end of the path of the pairs that are lost, (failures, K) [m], [rad].

        Bounded QPs go on within all limits, whatever the error; pairs that are survived are NaN.
        """
        found = np.full((2, *self.status.shape), np.nan)
        lost = np.flatnonzero(~self.survived.T)
        if self.post == "planner":  # it went to the end itself
            found[0][~self.survived] = self.position[~self.survived]
            found[1][~self.survived] = self.rotation[~self.survived]
        elif len(lost):
            runs = self._pairs.runs(lost.tolist(), best=True)
            found[0].T[~self.survived.T], found[1].T[~self.survived.T] = runs.position, runs.rotation
        return found[0], found[1]

    def borderline(self) -> BoolArray:
        """Pairs whose verdict a small change may turn round, (failures, K).

        Survived, they come within 0.01 rad or m of a position limit or 2 % of a speed limit, or use more than
        half of a tolerance. Lost, they break a speed limit only, or their best effort stays within twice the
        tolerances: an exact continuation may miss its path by far less than anybody would see.
        """
        position, rotation = self.best_effort()
        allowed = self.tolerance
        close = (self.position > 0.5 * allowed[0]) | (self.rotation > 0.5 * allowed[1])
        tight = (self.margin < CLOSE) | (self.hurry > HURRIED) | close
        nearly = (position <= 2.0 * allowed[0]) & (rotation <= 2.0 * allowed[1])
        lost = nearly | (self.status == Survival.VELOCITY)
        return np.asarray(np.where(self.survived, tight, lost))

    def continue_after(self, joint: str | int, time: float) -> FloatArray:
        """The verified motion after a failure, from the last sample at or before it, (K, nv) [rad or m].

        Args:
            joint: Its name or index, or a name among ``names``.
            time: From 0 to before the end of the path [s].

        Raises:
            InputError: No such failure was verified, the time is outside the path, or the planner went on.
            NotSurvived: The failure is not survived; it says what remains.
        """
        row = self._row(joint)
        if self.post == "planner":
            raise InputError(
                "with post='planner' no continuation is kept; run the planner, or verify with 'exact' or 'qp'"
            )
        if not 0.0 <= time < self.task.t[-1]:
            raise InputError(f"time is {time:g} s, expected from 0 to before {self.task.t[-1]:g} s")
        k = int(np.searchsorted(self.task.t, time + 1e-9)) - 1
        failed, exact = list(self.failures[row]), self.post == "exact"
        at = np.array([k])
        pairs = self._pairs
        settings: dict[str, Any] = {"share": pairs.share, "speed": pairs.speeds[at][:, failed]}
        one = pairs.study.runs(self.q[at], at, [failed], bounded=not exact, **settings)
        verdict = Survival(int(one.status[0]))
        limits = self.task.robot.limits
        if (self.q[k] < limits.q_min).any() or (self.q[k] > limits.q_max).any():
            verdict = Survival.NOMINAL
        motion = pairs.study.motion(
            self.q[k], k, failed, bounded=not exact, share=pairs.share, speed=pairs.speeds[k][failed]
        )
        if verdict is not Survival.SURVIVED:
            best = pairs.study.runs(self.q[at], at, [failed], bounded=True, whole=True, **settings)
            last = max(k, int(one.sample[0]) - 1)
            raise NotSurvived(
                joint=self.names[row],
                time=float(self.task.t[k]),
                until=float(self.task.t[last]),
                reason=verdict,
                q=motion[: last - k + 1],
                errors=(float(best.position[0]), float(best.rotation[0])),
            )
        return motion

    def way_round(self, joint: str | int, time: float) -> FloatArray:
        """How the other joints come to the end of the path, leaving it, where a failure is not survived.

        From where the path is lost the search of ``ftqp.GoTo`` looks for a way to its last pose, within the
        tolerances, round what stands around; the joint that has failed stands, or is as slow as it is.

        Args:
            joint: Its name or index, or a name among ``names``.
            time: From 0 to before the end of the path [s].

        Returns:
            The joints in every millisecond from rest to rest, (ticks, nv) [rad or m].

        Raises:
            InputError: As of ``continue_after``, or the failure is survived on the path.
            NotSurvived: No way round was found either; the message says what was looked for.
        """
        try:
            self.continue_after(joint, time)
        except NotSurvived as lost:
            return self._round(self._row(joint), lost)
        raise InputError(
            f"a failure of {joint!r} at t = {time:g} s is survived on the path; take continue_after"
        )

    def _round(self, row: int, lost: NotSurvived) -> FloatArray:
        """The way from where the path is lost to its end."""
        share = self._pairs.share
        motion, looked = way_round(
            self.task,
            lost.q[-1],
            faults=[
                Locked(i, mode="instant") if share is None else Degraded(i, velocity=share)
                for i in self.failures[row]
            ],
            pose=self.task.goals[-1],
            tolerance=self.tolerance,
        )
        if motion is None:
            raise NotSurvived(
                joint=lost.joint, time=lost.time, until=lost.until, reason=lost.reason, q=lost.q,
                errors=lost.errors, looked=looked,
            ) from None  # fmt: skip
        return motion

    def mission_survival(self, mtbf: Mapping[str | int, float]) -> MissionSurvival:
        """The probability that the task is finished although joints fail at random, with an interval.

        Args:
            mtbf: Mean time between failures by joint [h]; joints that are left out do not fail.

        Raises:
            InputError: A joint is unknown, a time is not positive, or failures are not of all single joints.
        """
        if self.failures != tuple((i,) for i in range(self.task.robot.nv)):
            raise InputError("mission survival needs a report on all single joints; leave joints out")
        return mission_survival(self.task.robot, self.survived, self.t, float(self.task.t[-1]), mtbf)

    def figure(self, path: str | Path) -> Path:
        """Draw which failures are survived, joint by joint over time, to a PNG file.

        Args:
            path: The file to write.

        Raises:
            MissingPackage: matplotlib is not installed.
        """
        return Path(painted("coverage", path, self))

    def _row(self, joint: str | int) -> int:
        if isinstance(joint, str) and joint in self.names:
            return self.names.index(joint)
        index = (self.task.robot.joint(joint),)
        if index not in self.failures:
            raise InputError(f"{joint!r} alone was not verified; expected one of {', '.join(self.names)}")
        return self.failures.index(index)
