"""The values that joints can have while the tip is at a goal, and whether it is within reach after a lock."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ftqp.analysis.circular_intervals import TURN, CircularIntervals
from ftqp.analysis.goals import GoalStudy, goal_study
from ftqp.analysis.manifolds.manifold import manifold_of, samples, traced_curves
from ftqp.analysis.manifolds.scanned_range import scanned_range
from ftqp.core.checks import BoolArray, FloatArray
from ftqp.core.errors import InputError
from ftqp.model.robot import Robot

COPIES = 4
"""Whole turns each way by which values are copied where only one limit is known."""


def joint_ranges(robot: Robot, pose: Any, rows: Any = "position") -> dict[str, CircularIntervals]:
    """B_i, by joint name: the values of joint i with which the other joints reach the goal.

    After joint i alone has locked at a, the goal is within reach just where ``B[i].contains(a)``. With one
    joint to spare the ends are exact: extremes of all traced self-motions, solutions of f(q) = x, n_i = 0.
    With more, each joint is scanned in steps of 2 degrees by solving for the others; gaps and islands
    narrower than that can be missed, ends are found exactly. A joint that turns without limits has intervals
    on the circle, any other one plain ones within its limits. ``B[i].structural`` says that a joint stands
    still in every self-motion, as the elbow of an arm with spherical shoulder and wrist does with a pose.
    Source: goel2005; docs/theory/unidentified-failures.md, "Ranges of joints".

    Args:
        robot: The arm.
        pose: The goal: a pose (4, 4), or a point (2,) or (3,) where no rotation counts [m].
        rows: ``"pose"`` or ``"position"``, which are those of the robot's own rows, or names of rows.

    Raises:
        InputError: The goal does not fit the rows, or is outside the workspace.
    """
    return ranges_of(goal_study(robot, pose, rows))


def ranges_of(study: GoalStudy) -> dict[str, CircularIntervals]:
    """The same of a study."""
    limits, revolute = study.robot.limits, ~study.robot.chain.prismatic
    wide = revolute & ~study.turning & (limits.q_max - limits.q_min >= TURN)  # every angle lies within them
    if wide.any():
        return _copied(study, wide)
    joints, turning = study.robot.joints, study.turning
    if study.redundancy == 1:
        parts = [manifold_of(study, curve).ranges() for curve in traced_curves(study)]
        return {
            joint: CircularIntervals.of(
                [pair for part in parts for pair in part[joint].intervals], circular=bool(turns)
            )
            for joint, turns in zip(joints, turning, strict=True)
        }
    solutions = samples(study)
    if study.redundancy < 1:
        return {
            joint: CircularIntervals.of([(float(a), float(a)) for a in values], circular=bool(turns))
            for joint, values, turns in zip(joints, solutions.T, turning, strict=True)
        }
    return {joint: scanned_range(study, i, solutions) for i, joint in enumerate(joints)}


def _copied(study: GoalStudy, wide: BoolArray) -> dict[str, CircularIntervals]:
    """The ranges with wide joints turning freely, and their values then copied into their limits."""
    limits = study.robot.limits
    low, high = np.where(wide, -np.inf, limits.q_min), np.where(wide, np.inf, limits.q_max)
    free = ranges_of(goal_study(study.robot.with_limits(q_min=low, q_max=high), study.pose, study.rows))
    for i in np.flatnonzero(wide):
        first, last = float(limits.q_min[i]), float(limits.q_max[i])
        most = int(np.ceil(max(abs(first), abs(last)) / TURN)) + 1 if np.isfinite(first + last) else COPIES
        turns = TURN * np.arange(-most, most + 1)
        joint = study.robot.joints[i]
        pairs = [
            (max(a + turn, first), min(b + turn, last)) for a, b in free[joint].intervals for turn in turns
        ]
        free[joint] = CircularIntervals.of([p for p in pairs if p[0] <= p[1]], circular=False)
    return free


STARTS = 512
"""Starts of the joints that are left."""

AT_END = 1e-9
"""How far beyond the end of its range a locked joint may be [rad or m]."""


def reachable_after(
    robot: Robot, goal: Any, locked: Mapping[str | int, float], rows: Any = "position"
) -> bool:
    """Whether the other joints can bring the end effector to the goal when some are locked at given values.

    The arm of the joints that are left is solved from 512 quasi-random starts within its limits. Where none
    arrives, the answer for one locked joint is that of ``joint_ranges``; for several locked joints False says
    that none of these starts arrived.
    Source: goel2005; docs/theory/unidentified-failures.md, "Reach after a lock".

    Args:
        robot: The arm.
        goal: A pose (4, 4), or a point (2,) or (3,) where no rotation counts [m].
        locked: The value of each locked joint, by name or 0-based index [rad or m].
        rows: ``"pose"`` or ``"position"``, which are those of the robot's own rows, or names of rows.

    Raises:
        InputError: A joint is unknown, all joints are locked, or the goal does not fit the rows.
    """
    study = goal_study(robot, goal, rows)
    held = locked_values(robot, locked)
    if reduced_solution(study, held) is not None:
        return True
    if len(held) != 1:
        return False
    (i, value), *_ = held.items()
    try:
        ranges = ranges_of(study)
    except InputError:  # the goal is outside the workspace of the whole arm
        return False
    return bool(ranges[robot.joints[i]].contains(value, AT_END))


def locked_values(robot: Robot, locked: Mapping[str | int, float]) -> dict[int, float]:
    """The values of locked joints by index."""
    held: dict[int, float] = {}
    for joint, value in locked.items():
        i = robot.joint(joint)
        if i in held:
            raise InputError(f"locked has {robot.joints[i]!r} twice, by name and by index; give it once")
        if not np.isfinite(value):
            raise InputError(f"locked has {value} for {robot.joints[i]!r}, expected a finite position")
        held[i] = float(value)
    if not 0 < len(held) < robot.nv:
        raise InputError(f"{len(held)} joints are locked, expected 1 to {robot.nv - 1} of {robot.nv}")
    return held


def reduced_solution(study: GoalStudy, held: Mapping[int, float]) -> FloatArray | None:
    """A configuration at the goal with joints held, within the limits of the others, or None."""
    session = study.limited.copy()
    session.hold(list(held))
    starts = study.starts(STARTS, limited=True)
    starts[:, list(held)] = list(held.values())
    q, errors, _ = session.solutions(starts, bounded=True)
    done = errors <= study.tolerance
    return np.asarray(q[np.argmax(done)]) if done.any() else None
