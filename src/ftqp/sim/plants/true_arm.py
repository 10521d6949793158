"""How the true arm differs from the one that its planner knows: load, masses, friction, brakes, end stops."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from ftqp.core.checks import FloatArray, non_negative, positive
from ftqp.core.errors import InputError
from ftqp.core.setting import setting
from ftqp.model.chain import Chain
from ftqp.model.payload import Payload
from ftqp.model.robot import Robot

CLEARANCE = 0.05
"""How far beyond the planner's limits an end stop is at most [rad or m]."""
CLEARANCE_SHARE = 0.05
"""The same as a share of the joint's range."""
BRAKE = 2.0
"""Torque of a brake as a multiple of the joint's torque limit."""
STOPS_AT = 1000.0
"""Deceleration of a joint without torque limit by its own brake [rad/s2 or m/s2]: 1 rad/s in 1 ms."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class TrueArm:
    """What is true of an arm and unknown to its planner; each joint's entry by name, or one number for all.

    Args:
        payload: a load at the tip beside that of the model; None is nothing.
        mass_scale: all masses and inertias are so many times those of the model, > 0.
        coulomb: dry friction beside that of the model, >= 0 [N m or N]; the joint sticks below it.
        viscous: viscous friction beside that of the model, >= 0 [N m s/rad or N s/m].
        brake: torque that a closed brake holds, > 0 [N m or N]; with less than its load the joint slips. A
            joint without entry has twice its torque limit.
        end_stops: how far beyond the limits the end stops are, >= 0 [rad or m]; None is 0.05, at most 5 % of
            the range.

    Raises:
        InputError: a value out of its range.
    """

    payload: Payload | None = setting(None, "a load at the tip that the planner does not know of")
    mass_scale: float = setting(1.0, "true masses by those of the model, > 0", above=0.0)
    coulomb: float | Mapping[str, float] = setting(
        0.0,
        "dry friction beside that of the model, >= 0: one number, or a table by joint name",
        unit="N m or N",
        least=0.0,
    )
    viscous: float | Mapping[str, float] = setting(
        0.0,
        "viscous friction beside that of the model, >= 0: one number, or a table by joint name",
        unit="N m s/rad or N s/m",
        least=0.0,
    )
    brake: Mapping[str, float] | None = setting(
        {},
        "what the brake of a joint holds, by joint name, > 0; it slips above; "
        "twice the torque limit for a joint that is absent",
        unit="N m or N",
        above=0.0,
    )
    end_stops: float | None = setting(
        None,
        "room between a limit and its end stop, >= 0; 0.05, at most 5 % of the range, if absent",
        unit="rad or m",
        least=0.0,
    )

    def __post_init__(self) -> None:
        positive("mass_scale", self.mass_scale)
        if self.end_stops is not None:
            non_negative("end_stops", self.end_stops, "rad")

    def chain(self, robot: Robot) -> Chain:
        """The robot's chain with the true masses and the load at its tip.

        Args:
            robot: the arm as the planner knows it.
        """
        scale, load = self.mass_scale, self.payload
        if load is not None:
            robot = robot.with_payload(Payload(load.mass / scale, load.com, load.inertia / scale))
        chain = robot.chain
        return replace(chain, mass=scale * chain.mass, inertia=scale * chain.inertia)

    def friction(self, robot: Robot) -> tuple[FloatArray, FloatArray]:
        """Dry and viscous friction of every joint, each (nv,) [N m, N m s/rad].

        Args:
            robot: the arm as the planner knows it.
        """
        dry, viscous = _per_joint("coulomb", self.coulomb, robot), _per_joint("viscous", self.viscous, robot)
        return robot.coulomb + dry, robot.viscous + viscous

    def brakes(self, robot: Robot, inertia: FloatArray) -> FloatArray:
        """Torque that the brake of every joint holds, (nv,) [N m or N].

        Args:
            robot: the arm.
            inertia: diagonal of M somewhere, (nv,), for joints without torque limit.
        """
        limits = robot.limits.tau_max
        torques = np.where(np.isfinite(limits), BRAKE * limits, STOPS_AT * inertia)
        for name, torque in (self.brake or {}).items():
            torques[robot.joint(name)] = positive(f"brake of {name}", torque, "N m")
        return torques

    def stops(self, robot: Robot) -> tuple[FloatArray, FloatArray]:
        """Lower and upper end stops, each (nv,) [rad or m]; infinite where there is none.

        Args:
            robot: the arm as the planner knows it.
        """
        low, high = robot.limits.q_min, robot.limits.q_max
        spread = np.where(np.isfinite(low) & np.isfinite(high), high - low, np.inf)
        room = np.minimum(CLEARANCE, CLEARANCE_SHARE * spread) if self.end_stops is None else self.end_stops
        return low - room, high + room


def _per_joint(name: str, value: Any, robot: Robot) -> FloatArray:
    """One number for all joints, or some by name and 0 for the others, (nv,)."""
    if isinstance(value, Mapping):
        result = np.zeros(robot.nv)
        for joint, number in value.items():
            result[robot.joint(joint)] = non_negative(f"{name} of {joint}", number)
        return result
    if isinstance(value, str) or np.ndim(value) != 0:
        raise InputError(f"{name} is {value!r}, expected a number for all joints or a table by joint name")
    return np.full(robot.nv, non_negative(name, value))
