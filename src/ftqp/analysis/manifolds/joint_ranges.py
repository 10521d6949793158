"""The values that each joint of an arm can have while its tip is at a goal."""

from typing import Any

from ftqp.analysis.circular_intervals import CircularIntervals
from ftqp.analysis.goals import GoalStudy, goal_study
from ftqp.analysis.manifolds.manifold import manifold_of
from ftqp.analysis.manifolds.scanned_range import scanned_range
from ftqp.analysis.manifolds.self_motion import samples, traced_curves
from ftqp.model.robot import Robot


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
    """The same of a study.

    Args:
        study: Of the goal.

    Raises:
        InputError: The goal is outside the workspace.
    """
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
