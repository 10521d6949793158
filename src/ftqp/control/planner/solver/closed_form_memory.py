"""What a closed form needs to know of the robot, once: its memory, and the wrist centre."""

import numpy as np

from ftqp.control.task.resolvers import Resolver
from ftqp.core.errors import InputError
from ftqp.kernel.entry.session import Reduced, Session
from ftqp.kernel.layout.enums import TASK_ROWS
from ftqp.kernel.layout.method_codes import ClosedForm
from ftqp.model.robot import Robot

TOLERANCE = 1e-6
"""Largest distance of an axis from the common point [m] ..."""
PARALLEL = 1e-6
"""... and sine of the angle below which two axes count as parallel. A convention, so that numbers which a
file gives to six digits pass."""


def closed_form_memory(resolver: Resolver, robot: Robot, session: Session) -> Reduced:
    """The memory in which a planner's closed form is solved.

    Raises:
        InputError: weights, limits or a wrist that do not go with the closed form.
    """
    name = resolver.name
    reduced = Reduced(robot.nv)
    P = reduced.P
    P.method, P.rule, P.threshold = resolver.method, resolver.rule_code, resolver.threshold
    if resolver.weights is not None:
        if len(resolver.weights) != robot.nv:
            raise InputError(
                f"scheme {name!r} has {len(resolver.weights)} weights, expected one a joint: {robot.nv}"
            )
        P.column[: robot.nv] = 1.0 / np.sqrt(resolver.weights)
    if resolver.method == ClosedForm.DAMPED and resolver.limit is None:
        endless = [j for j, v in zip(robot.joints, robot.limits.v_max, strict=True) if not np.isfinite(v)]
        if endless:
            raise InputError(
                f"{robot.name} has no velocity limit on {', '.join(endless)}; give {name}(limit=...)"
            )
        P.own_limits = 1
    elif resolver.limit is not None:
        P.limit = resolver.limit
    if resolver.method == ClosedForm.APPROXIMATE:
        if session.K.task.m != TASK_ROWS or session.K.task.tool_rows:
            raise InputError(f"scheme {name!r} follows whole poses; use Task(rows='pose')")
        P.wrist = wrist_height(robot)
    return reduced


def wrist_height(robot: Robot) -> float:
    """Where the wrist centre lies on the axis of the last joint but one, from that joint's origin [m].

    The last axis must meet the middle one there, and the first one, too: then they meet at every posture.

    Raises:
        InputError: fewer than four joints, branches, or last three that form no spherical wrist.
    """
    robot.refuse_tree("approximate_pseudoinverse needs")
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
