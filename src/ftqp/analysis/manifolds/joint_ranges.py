"""The values that each joint of an arm can have while its tip is at a goal."""

from typing import Any

import numpy as np

from ftqp.analysis.circular_intervals import TURN, CircularIntervals
from ftqp.analysis.goals import GoalStudy, goal_study
from ftqp.analysis.manifolds.manifold import manifold_of
from ftqp.analysis.manifolds.scanned_range import scanned_range
from ftqp.analysis.manifolds.self_motion import samples, traced_curves
from ftqp.core.checks import BoolArray
from ftqp.model.robot import Robot

COPIES = 4
"""Whole turns each way by which values are copied where only one limit is known."""


def joint_ranges(robot: Robot, pose: Any, rows: Any = "position") -> dict[str, CircularIntervals]:
    """B_i, by joint name: the values of joint i with which the other joints can bring the tip to the goal.

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
    wide = _wide(study)
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


def _wide(study: GoalStudy) -> BoolArray:
    """Joints with limits a turn apart or more: every angle lies within them."""
    limits, turns = study.robot.limits, ~study.robot.chain.prismatic
    return np.asarray(turns & ~study.turning & (limits.q_max - limits.q_min >= TURN))


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
