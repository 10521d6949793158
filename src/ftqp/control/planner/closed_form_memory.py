"""What a closed form needs to know of the robot, once: its memory, and the wrist centre."""

from typing import Any

import numpy as np

from ftqp.control.task.resolvers import Resolver
from ftqp.control.task.scheme import Scheme
from ftqp.control.task.task import Task
from ftqp.core.errors import InputError
from ftqp.kernel.closed_forms.reduced_problem import memory
from ftqp.kernel.layout import enums as codes
from ftqp.model.robot import Robot

TOLERANCE = 1e-6
"""Largest distance of an axis from the common point [m]."""
PARALLEL = 1e-6
"""Sine of the angle below which two axes count as parallel."""


def closed_form_memory(
    scheme: Scheme | Resolver, robot: Robot, task: Task, in_kernel: bool, record: Any
) -> Any:
    """The memory of the closed form, (1,), its address in the planner's record; None for a scheme with a QP.

    Raises:
        InputError: a backend, a task mode, weights, limits or a wrist that do not go with the closed form.
    """
    if not isinstance(scheme, Resolver):
        return None
    name = scheme.name
    if not in_kernel:
        raise InputError(
            f"scheme {name!r} is a closed form and has no backend; leave backend at 'active_set'"
        )
    if task.mode != "slack":
        raise InputError(
            f"scheme {name!r} is a closed form and has no task mode; leave mode at 'slack', got {task.mode!r}"
        )
    P = memory()
    P["method"], P["rule"], P["threshold"] = scheme.method, scheme.rule_code, scheme.threshold
    if scheme.weights is not None:
        if len(scheme.weights) != robot.nv:
            raise InputError(
                f"scheme {name!r} has {len(scheme.weights)} weights, expected one a joint: {robot.nv}"
            )
        P["column"][0, : robot.nv] = 1.0 / np.sqrt(scheme.weights)
    if scheme.method == codes.DAMPED and scheme.limit is None:
        endless = [j for j, v in zip(robot.joints, robot.limits.v_max, strict=True) if not np.isfinite(v)]
        if endless:
            raise InputError(
                f"{robot.name} has no velocity limit on {', '.join(endless)}; give {name}(limit=...)"
            )
        P["own_limits"] = 1
    elif scheme.limit is not None:
        P["limit"] = scheme.limit
    if scheme.method == codes.APPROXIMATE:
        if record["m"][0] != codes.ROWS or record["tool_rows"][0]:
            raise InputError(f"scheme {name!r} follows whole poses; use Task(rows='pose')")
        P["wrist"] = wrist_height(robot)
    record["resolver"] = P.ctypes.data
    return P


def wrist_height(robot: Robot) -> float:
    """Where the wrist centre lies on the axis of the last joint but one, from that joint's origin [m].

    The last axis must meet the middle one there, and the first one, too: then they meet at every posture.

    Raises:
        InputError: fewer than four joints, or last three that form no spherical wrist.
    """
    chain = robot.chain
    reason = ""
    if robot.nv < 4:
        reason = f"it has {robot.nv} joints"
    elif chain.prismatic[-3:].any():
        reason = "one of them slides"
    else:
        along, at = chain.rotation[-1][:, 2], chain.translation[-1]  # the last axis in the middle frame
        across = float(along[0] ** 2 + along[1] ** 2)
        turn, shift = chain.rotation[-2], chain.translation[-2]
        if across < PARALLEL**2 or float(np.hypot(turn[0, 2], turn[1, 2])) < PARALLEL:
            reason = "two of their axes are parallel"
        else:
            near = at - along * float(along[0] * at[0] + along[1] * at[1]) / across
            centre = shift + turn @ np.array([0.0, 0.0, near[2]])
            if max(float(np.hypot(near[0], near[1])), float(np.hypot(centre[0], centre[1]))) <= TOLERANCE:
                return float(near[2])
            reason = "their axes do not meet in one point"
    raise InputError(
        f"approximate_pseudoinverse needs a spherical wrist, but the last three joints of {robot.name} form "
        f"none: {reason}; use pseudoinverse or singularity_robust"
    )
