"""Where an arm stands on its way to a goal, in words."""

from collections.abc import Mapping
from enum import Enum
from typing import Any, final

import numpy as np

from ftqp.control.planner.planner_view import PlannerView
from ftqp.core.checks import FloatArray, perhaps_degrees
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Fault
from ftqp.kernel.layout.thresholds import COMES_NEARER, SLOW_SHARE, STRONG
from ftqp.model.robot import Robot

ONLY_THE_TIP = "the end effector is at its goal, while the scheme goes on moving the joints"
"""The sentence of a pose that is reached where the joints do not come to rest."""


class GoToStatus(Enum):
    """Where the arm stands on its way; the value is the sentence for the operator."""

    MOVING = "the arm is on its way"
    REACHED = "the arm rests at its goal"
    UNREACHABLE = "the arm rests as near to its goal as it gets"
    HALTED = "the planner brakes or has stopped the arm"


def missed_by(position: float, rotation: float, tolerances: tuple[float, float]) -> str:
    """By how much a frame misses its goal, in words; empty where it does not."""
    parts = (
        (position > tolerances[0], f"{1e3 * position:.3g} mm" if position < 1.0 else f"{position:.3g} m"),
        (rotation > tolerances[1], f"{rotation:.3g} rad"),
    )
    return " and ".join(text for misses, text in parts if misses)


def missed_joints(robot: Robot, way: FloatArray, faults: Mapping[str, Fault], tolerance: float) -> list[str]:
    """Which joints miss their goal, and by how much."""
    return [
        f"{joint}{_in_brackets(faults.get(joint))} by {abs(left):.3g} {'m' if slides else 'rad'}"
        for joint, left, slides in zip(robot.joints, way, robot.chain.prismatic, strict=True)
        if abs(left) > tolerance
    ]


def overlap(distances: Mapping[tuple[str, str], Any]) -> list[str]:
    """The two bodies that are kept apart and overlap most, in words; none where none do."""
    least, pair = min(((float(d), pair) for pair, d in distances.items()), default=(0.0, ("", "")))
    return [f"{pair[0]} and {pair[1]} overlap by {-1e3 * least:.3g} mm"] if least < 0.0 else []


def posture_inside(robot: Robot, q: Any) -> FloatArray:
    """The posture, if it is within the limits of every joint."""
    goal = robot.angles(q)
    limits = robot.limits
    for i, joint in enumerate(robot.joints):
        low, high = float(limits.q_min[i]), float(limits.q_max[i])
        if not low <= goal[i] <= high and not robot.continuous[i]:
            raise InputError(
                f"q puts {joint} at {goal[i]:.6g}, outside its limits {low:.6g} to {high:.6g}; "
                "choose a posture inside them" + perhaps_degrees(max(low - goal[i], goal[i] - high))
            )
    return goal


def is_held(view: PlannerView) -> bool:
    """Whether the motors can hold the arm at rest where it is commanded."""
    working = view.working
    limit = view.limits.tau[working]
    if not np.isfinite(limit).any():
        return True
    held = view.holding_torques(view.command.q[None])[0, working]
    return bool((np.abs(held) <= STRONG * limit).all())


def _in_brackets(fault: Any) -> str:
    return "" if fault is None else f" ({fault.kind.replace('_', '-')})"


@final
class ConvergenceMonitor:
    """What a motion to a goal remembers of its distances, tick by tick."""

    __slots__ = ("_best", "_dt", "_since", "_slow", "_there")

    def __init__(self, dt: float) -> None:
        self._dt = dt
        self.begin()

    def begin(self) -> None:
        """Another way begins."""
        self._best = np.inf
        self._since = self._slow = self._there = 0

    def wait(self, *, for_rest: bool = False) -> None:
        """Wait anew for the arm to come nearer, and to be slow."""
        self._since, self._slow = 0, 0 if for_rest else self._slow

    def look(self, speed: float, is_there: bool) -> None:
        """A tick: the largest speed of a joint, as a share of its limit, and whether the goal is met."""
        self._slow = self._slow + 1 if speed < SLOW_SHARE else 0
        self._there = self._there + 1 if is_there else 0

    def is_nearer(self, distance: float) -> bool:
        """Whether a distance is less than all before, by enough; it is counted since when none was."""
        if distance < self._best - COMES_NEARER * min(self._best, 1.0 + distance) or self._best == np.inf:
            self._best, self._since = distance, 0
            return True
        self._since += 1
        return False

    @property
    def waited(self) -> float:
        """How long the arm has come no nearer [s]."""
        return self._since * self._dt

    @property
    def stood(self) -> float:
        """How long it has come no nearer and been slow [s]."""
        return min(self._since, self._slow) * self._dt

    @property
    def stayed(self) -> float:
        """How long it has been at its goal [s]."""
        return self._there * self._dt
