"""Where an arm stands on its way to a goal, in words."""

from collections.abc import Mapping
from enum import Enum
from typing import Any

import numpy as np

from ftqp.control.inverse_kinematics.passable import HELD
from ftqp.control.planner.planner_view import PlannerView
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Fault
from ftqp.kernel.layout.thresholds import AT_REST
from ftqp.model.robot import Robot

ONLY_THE_TIP = "the tip is at its goal, while the scheme goes on moving the joints"
"""The sentence of a pose that is reached where the joints do not come to rest."""


class GoToStatus(Enum):
    """Where the arm stands on its way; the value is the sentence for the operator."""

    MOVING = "the arm is on its way"
    REACHED = "the arm rests at its goal"
    UNREACHABLE = "the arm rests as near to its goal as it gets"
    HALTED = "the planner brakes or has stopped the arm"


def missed_by(position: float, rotation: float, tolerances: tuple[float, float]) -> str:
    """By how much a frame misses its goal, in words; empty where it does not.

    Args:
        position: How far it is [m].
        rotation: How far it is turned [rad].
        tolerances: What counts as missing [m], [rad].
    """
    parts = (
        (position > tolerances[0], f"{1e3 * position:.3g} mm"),
        (rotation > tolerances[1], f"{rotation:.3g} rad"),
    )
    return " and ".join(text for misses, text in parts if misses)


def missed_joints(robot: Robot, way: FloatArray, faults: Mapping[str, Fault], tolerance: float) -> list[str]:
    """Which joints miss their goal, and by how much.

    Args:
        robot: The arm.
        way: What is left of the way of every joint, (nv,) [rad or m].
        faults: Those that are believed, by joint.
        tolerance: What counts as missing [rad or m].
    """
    return [
        f"{joint}{_in_brackets(faults.get(joint))} by {abs(left):.3g} {'m' if slides else 'rad'}"
        for joint, left, slides in zip(robot.joints, way, robot.chain.prismatic, strict=True)
        if abs(left) > tolerance
    ]


def posture_inside(robot: Robot, q: Any) -> FloatArray:
    """The posture, if it is within the limits of every joint."""
    goal = robot.angles(q)
    limits = robot.limits
    for i, joint in enumerate(robot.joints):
        low, high = float(limits.q_min[i]), float(limits.q_max[i])
        if not low <= goal[i] <= high and not robot.continuous[i]:
            raise InputError(
                f"q puts {joint} at {goal[i]:.6g}, outside its limits {low:.6g} to {high:.6g}; "
                "choose a posture inside them"
            )
    return goal


def is_held(view: PlannerView) -> bool:
    """Whether the motors can hold the arm at rest where it is commanded."""
    working = view.working
    limit = view.limits.tau[working]
    if not np.isfinite(limit).any():
        return True
    held = view.holding_torques(view.command.q[None])[0, working]
    return bool((np.abs(held) <= HELD * limit).all())


def fastest(view: PlannerView) -> float:
    """Largest speed of a joint that works, as a share of its limit."""
    top = np.minimum(view.limits.v, 1.0 / AT_REST)
    return float((np.abs(view.command.v) / top)[view.working].max(initial=0.0))


def _in_brackets(fault: Any) -> str:
    return "" if fault is None else f" ({fault.kind.replace('_', '-')})"
