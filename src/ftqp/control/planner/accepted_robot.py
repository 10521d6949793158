"""Which arms a planner takes."""

import numpy as np

from ftqp.core.checks import instance
from ftqp.core.errors import ModelError
from ftqp.kernel.layout.enums import JOINTS
from ftqp.model.robot import Robot

EXAMPLE = 'ftqp.robots.load("panda")'


def accepted(robot: Robot) -> Robot:
    """The robot, if a planner can drive it.

    Raises:
        InputError: This is no robot.
        ModelError: It has too many joints, or no acceleration limits.
    """
    instance("robot", robot, Robot, f"an ftqp.Robot, for example {EXAMPLE} or ftqp.Robot.from_urdf(file)")
    if robot.nv > JOINTS:
        raise ModelError(
            f"{robot.name} has {robot.nv} joints between base and tip; ftqp drives at most {JOINTS}"
        )
    endless = [j for j, a in zip(robot.joints, robot.limits.a_max, strict=True) if not np.isfinite(a)]
    if endless:
        missing = "a_max" if np.isfinite(robot.limits.v_max).all() else "v_max"
        says = "acceleration limit" if missing == "a_max" else "velocity limit, and so no acceleration limit,"
        raise ModelError(
            f"{robot.name} has no {says} on {', '.join(endless)}; braking needs one: "
            f"robot.with_limits({missing}=...)"
        )
    return robot
