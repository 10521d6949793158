"""Configuration branches: joints kept on one side of a singular posture by a narrower range."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ftqp.core.checks import instance
from ftqp.core.errors import InputError
from ftqp.model.robot import Robot


def within_branch(robot: Robot, limits: Mapping[str | int, Any]) -> Robot:
    """The robot with some joints kept in a range inside their own.

    An elbow that has to stay bent one way gets its singular angle plus a margin as one end. The planner
    brakes before these ends as before any position limit.

    Args:
        robot: The arm.
        limits: Joint, by name or 0-based index, to (low, high) [rad or m]; -inf and inf keep the joint's own
            end.
    """
    instance("branch_limits", limits, Mapping, "joints with their (low, high), {joint: (low, high)}")
    low, high = robot.limits.q_min.copy(), robot.limits.q_max.copy()
    for joint, ends in limits.items():
        i = robot.joint(joint)
        name = robot.joints[i]
        try:
            first, last = (float(end) for end in ends)
        except (TypeError, ValueError, OverflowError) as error:
            raise InputError(f"branch limits of {name} are {ends!r:.60}, expected (low, high)") from error
        if np.isnan(first) or np.isnan(last):
            raise InputError(f"branch limits of {name} are ({first:g}, {last:g}), expected numbers")
        low[i], high[i] = max(low[i], first), min(high[i], last)
        if not low[i] < high[i]:
            raise InputError(
                f"branch limits of {name} leave nothing: ({first:g}, {last:g}) of its range "
                f"[{robot.limits.q_min[i]:g}, {robot.limits.q_max[i]:g}]"
            )
    return robot.with_limits(q_min=low, q_max=high)
