"""Whether a goal is within reach after joints have locked."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ftqp.analysis.goals import GoalStudy, goal_study
from ftqp.analysis.manifolds.joint_ranges import ranges_of
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.model.robot import Robot

STARTS = 512
"""Starts of the joints that are left."""

AT_END = 1e-9
"""How far beyond the end of its range a locked joint may be [rad or m]."""


def reachable_after(
    robot: Robot, goal: Any, locked: Mapping[str | int, float], rows: Any = "position"
) -> bool:
    """Whether the other joints can bring the tip to the goal when some are locked at given values.

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
