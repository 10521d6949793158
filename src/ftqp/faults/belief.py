"""Belief: which joints are held to have failed, and how the planner's record gets them."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Self, final

import numpy as np

from ftqp.core.errors import InputError
from ftqp.faults.kinds import (
    MODES,
    RESETS,
    SWINGS,
    Degraded,
    Fault,
    FreeSwinging,
    Locked,
    not_served,
    refuse_unknown,
)
from ftqp.kernel.entry.planner_commands import PlannerCommands
from ftqp.kernel.layout.other_records import IS_LOCKED_NOW, SWINGS_NOW
from ftqp.kernel.layout.record import dtype
from ftqp.model.robot import Robot

SHARES = {"v_max": "velocity", "a_max": "acceleration", "tau_max": "torque"}
"""Limits, and what the share that is left of each is called in the kernel's record."""


@final
class Belief:
    """What a planner holds to be true of its joints; it never changes, another belief takes its place."""

    __slots__ = ("_faults", "_robot")

    def __init__(self, robot: Robot, *, faults: Mapping[int, Fault] | None = None) -> None:
        self._robot = robot
        self._faults = dict(sorted((faults or {}).items()))

    def _but(self, faults: Mapping[int, Fault]) -> Self:
        return type(self)(self._robot, faults=faults)

    @property
    def faults(self) -> dict[str, Fault]:
        """The faults believed now, by joint name; a copy."""
        return {self._robot.joints[i]: fault for i, fault in self._faults.items()}

    @property
    def needs_dynamics(self) -> bool:
        """Whether a row of the QP needs the inertia: a joint swings free."""
        return any(isinstance(fault, FreeSwinging) for fault in self._faults.values())

    def reported(self, fault: Fault) -> Self:
        """This belief and a fault, which replaces what was believed of that joint."""
        refuse_unknown(fault)
        fault = self._of_leader(fault)
        i = self._robot.joint(fault.joint)
        if i < self._robot.chain.floating:
            raise InputError(
                f"{self._robot.joints[i]} has no motor that could fail, for {self._robot.name} floats; "
                f"report faults of {self._robot.joints[self._robot.chain.floating]} and the joints behind it"
            )
        if isinstance(fault, FreeSwinging) and not self._robot.has_inertia:
            raise InputError(
                f"{self._robot.name} has no inertia, so the motion of free-swinging {self._robot.joints[i]} "
                "is unknown; give the model its masses, or report ftqp.Locked"
            )
        match fault:
            case Locked():
                pass
            case FreeSwinging():
                self._robot.refuse_tree(SWINGS)
            case Degraded():
                self._refuse_empty_range(i, fault)
            case _:
                not_served(fault, "the planner")
        known = self._faults.get(i)
        if known is not None and replace(known, joint=fault.joint) == fault:  # by its name or its number
            return self
        return self._but(self._faults | {i: fault})

    def without(self, joint: str | int) -> Self:
        """This belief, but the joint is healthy."""
        i = int(self._robot.chain.lead[self._robot.joint(joint)])
        if i not in self._faults:
            return self
        return self._but({j: fault for j, fault in self._faults.items() if j != i})

    def write(self, commands: PlannerCommands, before: "Belief | None" = None) -> None:
        """Tell a record what follows from the belief; as often as one likes, before the next tick."""
        for i in range(self._robot.nv):
            was, fault = (None if before is None else before._faults.get(i)), self._faults.get(i)
            if before is not None and was == fault:
                continue
            commands.believe(fault_record(i, fault), isinstance(was, Locked))

    def _of_leader(self, fault: Fault) -> Fault:
        """The fault as it is of the joint whose motor it concerns."""
        chain, m = self._robot.chain, self._robot.joint(fault.joint)
        l = int(chain.lead[m])
        if l == m:
            return fault
        led = replace(fault, joint=self._robot.joints[l])
        match led:
            case Degraded():
                ends = [
                    None if end is None else (end - chain.offset[m]) / chain.ratio[m]
                    for end in (led.q_min, led.q_max)
                ]
                low, high = ends if chain.ratio[m] > 0.0 else ends[::-1]
                return replace(led, q_min=low, q_max=high)
            case _:
                return led

    def _refuse_empty_range(self, i: int, fault: Degraded) -> None:
        """Refuse a fault that leaves nothing of the range of joint i."""
        limits = self._robot.limits
        low = limits.q_min[i] if fault.q_min is None else max(fault.q_min, limits.q_min[i])
        high = limits.q_max[i] if fault.q_max is None else min(fault.q_max, limits.q_max[i])
        if not low < high:
            raise InputError(
                f"the range left of {self._robot.joints[i]} is empty: [{low:g}, {high:g}]; "
                f"its healthy range is [{limits.q_min[i]:g}, {limits.q_max[i]:g}]"
            )


def weakens(robot: Robot, fault: Fault | None) -> bool:
    """Whether a fault leaves a joint less torque, of an arm whose weight is known."""
    if fault is None or not robot.has_inertia or "tau_max" not in fault.shares:
        return False
    return bool(getattr(fault, fault.shares["tau_max"]) < 1.0)


def fault_record(i: int, fault: Fault | None) -> Any:
    """What the kernel gets of joint i, None that it works: a record of kind ``fault``, (1,)."""
    memory = np.zeros(1, dtype("fault"))
    said = memory[0]
    said["joint"] = i
    for share in SHARES.values():
        said[share] = 1.0
    for end in ("deceleration", "q_min", "q_max"):
        said[end] = np.nan
    if fault is None:
        return memory
    for limit, share in fault.shares.items():
        said[SHARES[limit]] = getattr(fault, share)
    match fault:
        case Locked():
            said["kind"], said["mode"] = IS_LOCKED_NOW, MODES.index(fault.mode)
            said["reset"] = RESETS.index(fault.reset)
            if fault.deceleration is not None:
                said["deceleration"] = fault.deceleration
        case FreeSwinging():
            said["kind"], said["damping"], said["friction"] = SWINGS_NOW, fault.damping, fault.friction
        case Degraded():
            for end in ("q_min", "q_max"):
                value = getattr(fault, end)
                if value is not None:
                    said[end] = value
        case _:
            not_served(fault, "the planner")
    return memory
