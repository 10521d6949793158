"""Where an arm can work so that every place stays within reach whichever joint locks."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple, final

import numpy as np
from scipy.integrate import quad
from scipy.stats import binomtest

from ftqp.analysis.circular_intervals import TURN, WHOLE, CircularIntervals
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
        area: The size of the failure-tolerant workspace, exact up to quadrature, of a planar arm whose three
            joints turn without limits of their own, where x and y count; else nan [m2].
        reach: Of the same arm, the area within reach before a failure; else nan [m2].
    """

    joints: tuple[str, ...]
    q_min: FloatArray
    q_max: FloatArray
    poses: FloatArray
    kept: BoolArray
    area: float
    reach: float

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
    arm = _planar(study)
    area, reach = (np.nan, np.nan) if arm is None else arm.areas(np.stack([low, high], axis=1))
    kept = [_kept(goal_study(robot, pose, list(study.rows)), low, high) for pose in found]
    return TolerantWorkspace(
        joints=robot.joints,
        q_min=frozen(low),
        q_max=frozen(high),
        poses=frozen(found),
        kept=frozen(np.array(kept)),
        area=area,
        reach=reach,
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


class _Planar(NamedTuple):
    """The lengths of a planar arm whose three joints turn without limits [m]."""

    l1: float
    l2: float
    l3: float

    def areas(self, limits: FloatArray) -> tuple[float, float]:
        """The failure-tolerant area and that before a failure, r |Phi(r)| integrated over r."""
        limits = np.where(np.diff(limits, axis=1) < TURN, limits, WHOLE)
        (least, most), whole = self._radii(limits), sum(self)
        tolerant = _integral(lambda r: (self._before(r, limits) & self._after(r, limits)).size, least, most)
        return tolerant, _integral(lambda r: self._before(r, limits).size, 0.0, whole)

    def _radii(self, limits: FloatArray) -> tuple[float, float]:
        """Between which distances from the base the tip stays within reach wherever joint 2 or 3 locks."""
        l1, l2, l3 = self
        least, most = 0.0, np.inf
        for (low, high), a, b, rest in ((limits[1], l1, l2, l3), (limits[2], l2, l3, l1)):
            bends = np.array([low, high, *_between(low, high, 0.0), *_between(low, high, np.pi)])
            d = np.sqrt(np.maximum(a * a + b * b + 2.0 * a * b * np.cos(bends), 0.0))
            least, most = max(least, float(np.abs(d - rest).max())), min(most, float(d.min() + rest))
        return least, most

    def _after(self, r: float, limits: FloatArray) -> CircularIntervals:
        """Directions of the tip at a distance that stay within reach wherever joint 1 locks."""
        l1, l2, l3 = self
        low, high = limits[0]
        if abs(r - l1) > l2 + l3 or r + l1 < abs(l2 - l3):
            return CircularIntervals.of([])
        far, near = _angle(r, l1, l2 + l3), _angle(r, l1, abs(l2 - l3))
        if far == np.pi:  # an arc that goes round behind the base
            arcs = [WHOLE] if near == 0.0 else [(high + near, low + TURN - near)]
        elif near == 0.0:
            arcs = [(high - far, low + far)]
        else:
            arcs = [(high + near, low + far), (high - far, low - near)]
        return CircularIntervals.of([arc for arc in arcs if arc[0] <= arc[1]])

    def _before(self, r: float, limits: FloatArray) -> CircularIntervals:
        """Directions in which the tip comes to a distance with all joints within the artificial limits."""
        l1, l2, l3 = self
        (a1, b1), (a2, b2), (a3, b3) = limits
        second = CircularIntervals.of([(a2, b2)])
        cuts = [a3, b3, *_between(a3, b3, 0.0), *_between(a3, b3, np.pi)]
        for far in (abs(r - l1), r + l1):
            cuts += _either(a3, b3, np.pi - _bend(l2, l3, far), 0.0)
        for bend in (a2, b2):
            place = l1 + l2 * np.exp(1j * bend)
            cuts += _either(a3, b3, np.pi - _bend(abs(place), l3, r), float(np.angle(place)) - bend)
        cuts = sorted(cuts)
        found = []
        for begin, end in pairwise(cuts):
            middle = l2 + l3 * np.exp(0.5j * (begin + end))
            bent = np.pi - _bend(l1, abs(middle), r)
            for side in (1.0, -1.0):
                if np.isnan(bent) or not second.contains(side * bent - float(np.angle(middle))):
                    continue
                turns = [side * _angle(r, l1, abs(l2 + l3 * np.exp(1j * at))) for at in (begin, end)]
                found.append((a1 + min(turns), b1 + max(turns)))
        return CircularIntervals.of(found)


def _bend(a: float, b: float, opposite: float) -> float:
    """The angle between two sides of a triangle [rad]; nan without one."""
    if a * b == 0.0:
        return np.nan
    cosine = (a * a + b * b - opposite * opposite) / (2.0 * a * b)
    return float(np.arccos(cosine)) if abs(cosine) <= 1.0 else np.nan


def _angle(a: float, b: float, opposite: float) -> float:
    """The same, 0 or pi where there is no triangle."""
    return float(np.arccos(np.clip((a * a + b * b - opposite * opposite) / (2.0 * a * b), -1.0, 1.0)))


def _between(low: float, high: float, angle: float) -> list[float]:
    """An angle with whole turns, as often as it is between two values."""
    if np.isnan(angle):
        return []
    first = int(np.ceil((low - angle) / TURN))
    return [angle + TURN * k for k in range(first, int(np.floor((high - angle) / TURN)) + 1)]


def _either(low: float, high: float, angle: float, offset: float) -> list[float]:
    """The same of both signs of an angle, about an offset."""
    return [*_between(low, high, offset + angle), *_between(low, high, offset - angle)]


def _integral(size: Callable[[float], float], least: float, most: float) -> float:
    """The area between two radii at which so much of each circle belongs to it."""
    if not least < most:
        return 0.0
    cuts = np.linspace(least, most, PARTS + 1)
    return float(sum(quad(lambda r: r * size(r), a, b, epsabs=1e-7, limit=50)[0] for a, b in pairwise(cuts)))


PARTS = 8
"""The radius is parted so often, for the quadrature not to miss a narrow band."""


def _planar(study: GoalStudy) -> _Planar | None:
    """The lengths of a planar arm with three joints without limits where x and y count, else None."""
    chain, robot = study.robot.chain, study.robot
    if robot.nv != 3 or set(study.rows) != {"x", "y"} or not study.turning.all():
        return None
    axes = [np.eye(3)]
    for rotation in chain.rotation:
        axes.append(axes[-1] @ rotation)
    if any(abs(abs(axis[2, 2]) - 1.0) > NEARLY for axis in axes):
        return None
    if any(axis[2, 2] < 0.0 for axis in axes):
        return None
    places = [*chain.translation[1:], chain.tip_translation]
    lengths = [float(np.linalg.norm(place[:2])) for place in places]
    at = [float(np.arctan2(place[1], place[0])) for place in places]
    straight = max(abs(angle) for angle in at) < NEARLY
    return _Planar(*lengths) if straight and min(lengths) > 0.0 else None
