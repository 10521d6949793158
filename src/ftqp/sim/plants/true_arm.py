"""How the true arm differs from the one that its planner knows: masses, rotors, friction, brakes, stops."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from ftqp.core.checks import FloatArray, instance, non_negative, positive
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
MOST_JITTER = 0.99
"""A command that comes a whole control period late would be the next one's [1]."""
STOPS_AT = 1000.0
"""Deceleration of a joint without torque limit by its own brake [rad/s2 or m/s2]: 1 rad/s in 1 ms."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class TrueArm:
    """What is true of an arm and unknown to its planner; each joint's entry by name, or one number for all.

    Args:
        payload: a load at the end effector on top of the model's; None is nothing.
        mass_scale: all masses and inertias are so many times those of the model, > 0.
        rotors: inertia of rotors, as the joint feels it, on top of the model's, >= 0 [kg m2 or kg].
        coulomb: dry friction on top of the model's, >= 0 [N m or N]; the joint sticks below it.
        viscous: viscous friction on top of the model's, >= 0 [N m s/rad or N s/m].
        brake_delay: how long a brake takes to close, >= 0 [s]. Meanwhile a joint that fails coasts, and one
            that the planner wants braked goes on as it is sent.
        brake: torque that a closed brake holds, > 0, twice the torque limit where none is given [N m or N];
            with less than its load the joint slips.
        jitter: how late a command may come, as a share of the control period, 0 to 0.99: each but the first
            comes late by a share that is drawn anew, up to this one, in whole time steps of the physics.
        end_stops: how far beyond the limits the end stops are, >= 0 [rad or m]; None is 0.05, at most 5 % of
            the range.

    Raises:
        InputError: a value out of its range.
    """

    payload: Payload | None = setting(None)
    mass_scale: float = setting(1.0, above=0.0)
    rotors: float | Mapping[str, float] = setting(0.0, unit="kg m2 or kg", least=0.0)
    coulomb: float | Mapping[str, float] = setting(0.0, unit="N m or N", least=0.0)
    viscous: float | Mapping[str, float] = setting(0.0, unit="N m s/rad or N s/m", least=0.0)
    brake_delay: float = setting(0.0, unit="s", least=0.0)
    brake: Mapping[str, float] | None = setting({}, unit="N m or N", above=0.0)
    jitter: float = setting(0.0, least=0.0, most=MOST_JITTER)
    end_stops: float | None = setting(None, unit="rad or m", least=0.0)

    def __post_init__(self) -> None:
        instance("payload", self.payload, Payload | None, "an ftqp.Payload, ftqp.Payload(mass=0.5), or None")
        positive("mass_scale", self.mass_scale)
        non_negative("brake_delay", self.brake_delay, "s")
        if non_negative("jitter", self.jitter) > MOST_JITTER:
            raise InputError(f"jitter is {self.jitter:g}, expected a share of dt from 0 to {MOST_JITTER:g}")
        if self.end_stops is not None:
            non_negative("end_stops", self.end_stops, "rad")

    def chain(self, robot: Robot) -> Chain:
        """The robot's chain with the true masses and rotors and the load at its end effector.

        Args:
            robot: the arm as the planner knows it.
        """
        scale, load = self.mass_scale, self.payload
        if load is not None:
            robot = robot.with_payload(Payload(load.mass / scale, load.com, load.inertia / scale))
        chain = self.geared(robot).chain
        return replace(chain, mass=scale * chain.mass, inertia=scale * chain.inertia)

    def geared(self, robot: Robot) -> Robot:
        """The robot with the true rotors, which the maker of its servos knows.

        Args:
            robot: the arm as the planner knows it.
        """
        rotors = per_joint("rotors", self.rotors, robot)
        chain = robot.chain
        return replace(robot, chain=replace(chain, armature=chain.armature + rotors))

    def friction(self, robot: Robot) -> tuple[FloatArray, FloatArray]:
        """Dry and viscous friction of every joint, each (nv,) [N m, N m s/rad].

        Args:
            robot: the arm as the planner knows it.
        """
        dry, viscous = per_joint("coulomb", self.coulomb, robot), per_joint("viscous", self.viscous, robot)
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


def per_joint(name: str, value: Any, robot: Robot) -> FloatArray:
    """One number for all joints, or some by name and 0 for the others, (nv,)."""
    if isinstance(value, Mapping):
        result = np.zeros(robot.nv)
        for joint, number in value.items():
            result[robot.joint(joint)] = non_negative(f"{name} of {joint}", number)
        return result
    if isinstance(value, str) or np.ndim(value) != 0:
        raise InputError(f"{name} is {value!r}, expected a number for all joints or a table by joint name")
    return np.full(robot.nv, non_negative(name, value))
