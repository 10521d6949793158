"""Where an arm can work so that every place stays within reach whichever joint locks."""

from dataclasses import dataclass
from typing import Any, final

import numpy as np
from scipy.stats import binomtest

from ftqp.analysis.circular_intervals import TURN, CircularIntervals
from ftqp.analysis.goals import GoalStudy, goal_study, random_postures
from ftqp.analysis.manifolds.joint_ranges import ranges_of
from ftqp.core.checks import BoolArray, FloatArray, frozen, instance, whole_number
from ftqp.core.errors import InputError
from ftqp.model.robot import Robot


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TolerantWorkspace:
    """Which poses stay within reach wherever one joint locks; made by ``tolerant_workspace``.

    Attributes:
        joints: Names of the joints.
        q_min: The lower artificial limit of each, (nv,) [rad or m].
        q_max: The upper one, (nv,) [rad or m].
        poses: Poses of random postures within the artificial limits, (P, 4, 4).
        kept: Whether each stays within reach wherever joint i locks within its limits, (P, nv).
    """

    joints: tuple[str, ...]
    q_min: FloatArray
    q_max: FloatArray
    poses: FloatArray
    kept: BoolArray

    @property
    def tolerant(self) -> BoolArray:
        """Whether each pose stays within reach whichever joint locks, (P,)."""
        return np.asarray(self.kept.all(axis=1))

    @property
    def share(self) -> float:
        """The share of such poses, from 0 to 1."""
        return float(self.tolerant.mean())

    @property
    def by_joint(self) -> dict[str, float]:
        """The share of poses that stay within reach wherever this joint locks."""
        return dict(zip(self.joints, self.kept.mean(axis=0).tolist(), strict=True))

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of the share by Wilson's formula."""
        found = binomtest(int(self.tolerant.sum()), len(self.poses)).proportion_ci(method="wilson")
        return float(found.low), float(found.high)


def tolerant_workspace(
    robot: Robot, limits: Any = None, rows: Any = "position", *, poses: int = 200, seed: int = 0
) -> TolerantWorkspace:
    """The share of poses that stay within reach whichever joint locks, the healthy arm keeping its limits.

    Before a failure each joint stays within artificial limits A_i, so it locks in them; afterwards the others
    may use all of their own range. A pose is tolerant just where A_i is a part of B_i for every joint, B_i
    the values of joint i with which the others reach it, as ``joint_ranges`` has them: exact with one joint
    to spare, in steps of 2 degrees with more. Narrow artificial limits cost reach before a failure and save
    it afterwards.
    Source: roberts2007, hoover2007; docs/theory/unidentified-failures.md, "Tolerant workspace".

    Args:
        robot: The arm; it has more joints than task rows.
        limits: The artificial limits, (nv, 2), low and high of each within its own [rad or m]; None is that.
        rows: ``"pose"`` or ``"position"``, which are those of the robot's own rows, or names of rows.
        poses: How many are looked at, >= 1, each of a random posture within those. More narrow the interval.
        seed: Of the postures; the same arguments give the same report.

    Raises:
        InputError: The limits have another shape, are empty or go beyond the arm's own, the rows are unknown,
            or no joint is to spare.
    """
    instance("robot", robot, Robot, "a Robot")
    whole_number("poses", poses, 1)
    whole_number("seed", seed, 0)
    low, high = _artificial(robot, limits)
    postures = random_postures(robot.with_limits(q_min=low, q_max=high), poses, seed)
    found = np.array([robot.pose(q) for q in postures])
    study = goal_study(robot, found[0], rows)
    if study.redundancy < 1:
        raise InputError(
            f"{robot.name} has {robot.nv} joints and the task {study.m} rows, so that no lock is survived; "
            "expected more joints than rows"
        )
    kept = [_kept(goal_study(robot, pose, list(study.rows)), low, high) for pose in found]
    return TolerantWorkspace(
        joints=robot.joints,
        q_min=frozen(low),
        q_max=frozen(high),
        poses=frozen(found),
        kept=frozen(np.array(kept)),
    )


def _artificial(robot: Robot, limits: Any) -> tuple[FloatArray, FloatArray]:
    """The artificial limits, (nv,) each."""
    own = robot.limits
    if limits is None:
        return own.q_min.copy(), own.q_max.copy()
    try:
        given = np.asarray(limits, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"limits are {limits!r:.80}, expected low and high of each joint, (nv, 2)"
        ) from error
    if given.shape != (robot.nv, 2):
        raise InputError(f"limits have shape {given.shape}, expected (nv, 2) = ({robot.nv}, 2)")
    for joint, (low, high), least, most in zip(robot.joints, given, own.q_min, own.q_max, strict=True):
        if not low <= high:
            raise InputError(f"limits of {joint!r} are {low:g} and {high:g}, expected low <= high")
        if low < least or high > most:
            raise InputError(
                f"limits of {joint!r} are {low:g} and {high:g}, expected them within {least:g} and {most:g}"
            )
    return given[:, 0].copy(), given[:, 1].copy()


def _kept(study: GoalStudy, low: FloatArray, high: FloatArray) -> list[bool]:
    """Whether a pose stays within reach wherever each joint locks between its limits."""
    try:
        ranges = ranges_of(study)
    except InputError:  # it is at the edge of the workspace
        return [False] * len(low)
    return [_covers(ranges[joint], a, b) for joint, a, b in zip(study.robot.joints, low, high, strict=True)]


NEARLY = 1e-7
"""So far a limit may lie beyond the end of a range that was traced [rad or m]."""


def _covers(values: CircularIntervals, low: float, high: float) -> bool:
    """Whether all of an interval belongs to a union."""
    if values.whole or np.isinf(high) or np.isinf(low):
        return values.whole
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    for begin, end in values.intervals:
        away = middle - 0.5 * (begin + end)
        away -= TURN * np.round(away / TURN) if values.circular else 0.0
        if abs(away) + half <= 0.5 * (end - begin) + NEARLY:
            return True
    return False
