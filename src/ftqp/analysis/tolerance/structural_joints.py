"""Joints that a task can never do without, whatever the posture."""

from typing import Any

import numpy as np

from ftqp.analysis.goals import random_postures
from ftqp.analysis.survival.continuing import rows_session
from ftqp.analysis.tolerance.failed_sets import relative_manipulability
from ftqp.core.checks import FloatArray
from ftqp.model.robot import Robot

POSTURES = 200
"""Random postures that are looked at."""
NONE = 1e-9
"""A relative manipulability below this is none."""


def structural_joints(robot: Robot, rows: Any = "pose") -> tuple[str, ...]:
    """Names of the joints without which the task rows cannot be moved in any posture.

    They are those whose relative manipulability is below 1e-9 in 200 random postures within the limits, as
    the elbow of an arm with spherical shoulder and wrist and a pose: locked, it fixes the distance between
    both. With as many joints as rows all of them are.
    Source: docs/theory/coverage.md, "Why n_j is not the criterion".

    Args:
        robot: The arm.
        rows: ``"pose"`` or ``"position"``, which are those of the robot's own rows, ``"position_axis"`` for
            position and tool axis, or names of rows.

    Raises:
        InputError: The rows are unknown or more than joints.
    """
    share = relative_manipulability(random_jacobians(robot, rows, POSTURES))
    return tuple(joint for joint, least in zip(robot.joints, share.T, strict=True) if least.max() < NONE)


def random_jacobians(robot: Robot, rows: Any, count: int) -> FloatArray:
    """Jacobians of task rows at random postures within the limits, the same every time, (count, m, nv)."""
    q = random_postures(robot, count)
    session = rows_session(robot, rows)
    if not session.S.study.axis:
        return session.values(q)[1]
    found = []
    for one in q:  # the rows of a tool axis are those of its goal
        session.aim(robot.pose(one))
        found.append(session.values(one[None])[1][0])
    return np.array(found)
