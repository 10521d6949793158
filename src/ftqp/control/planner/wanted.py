"""What a planner was told since it was made, its load and tool among that, in one immutable object."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from ftqp.control.planner.braking_reserve import BrakingReserve
from ftqp.core.checks import FloatArray
from ftqp.core.pose import pose
from ftqp.faults.belief import Belief
from ftqp.kernel.entry.orders import NO_LOAD, Load
from ftqp.model.followers import coupled_columns
from ftqp.model.payload import Payload
from ftqp.model.posture import gravity_torques
from ftqp.model.robot import Robot

_LOG = logging.getLogger("ftqp")


@final
class Fitting:
    """A bare robot and what is mounted on it; it never changes, another fitting takes its place.

    Args:
        bare: The bare robot; loads and tools are in the frame of its tip.
        payload: The load; None is none.
        place: Pose of the controlled point, (4, 4); None is the robot's own tip.

    Attributes:
        robot: The robot as it is fitted.
        unloaded: The same without the load.
        payload: The load; None is none.
        load: The same as the kernel is told of it.
    """

    __slots__ = ("_bare", "_place", "load", "payload", "robot", "unloaded")

    def __init__(self, bare: Robot, payload: Payload | None = None, place: FloatArray | None = None) -> None:
        self._bare, self._place, self.payload = bare, place, payload
        self.unloaded = bare if place is None else bare.with_tip(place, f"{bare.tip} tool")
        robot = bare if payload is None else bare.with_payload(payload)
        self.robot = robot if place is None else robot.with_tip(place, f"{robot.tip} tool")
        self.load = NO_LOAD if payload is None else Load(payload.mass, payload.com, payload.inertia)

    def carrying(self, payload: Payload | None) -> "Fitting":
        """The robot with another load."""
        return Fitting(self._bare, payload, self._place)

    def holding(self, T: Any) -> "Fitting":
        """The robot with another controlled point, (4, 4) in the frame of the bare robot's tip."""
        return Fitting(self._bare, self.payload, None if T is None else pose(T, "T"))


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """Where the arm begins.

    Attributes:
        q: Joint positions, (nv,) [rad or m].
        v: Joint velocities, (nv,) [rad/s or m/s].
    """

    q: FloatArray
    v: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Wanted:
    """All that a planner was told.

    Attributes:
        belief: Which joints have failed.
        fitting: The arm with its load and tool.
        reserve: The deceleration that its motors have; None where torque is not limited.
        start: Where the arm begins; None before the first ``reset``.
        speed: How fast the arm is led, in (0, 1] of full speed.
        then: What else the last change brings about, as often as it is called; None is nothing.
    """

    belief: Belief
    fitting: Fitting
    reserve: BrakingReserve | None
    start: Start | None = None
    speed: float = 1.0
    then: Callable[[], None] | None = None


def weight_sentence(robot: Robot, q: FloatArray, tau_max: FloatArray) -> str:
    """What is to be said where a motor cannot hold the arm at rest at q; empty where all can.

    Args:
        robot: The arm with its load.
        q: Joint positions, (nv,) [rad or m].
        tau_max: Torque limits believed now, (nv,) [N m or N].
    """
    holding = gravity_torques(robot.model, robot.model.createData(), robot.configuration(q))
    tau = np.abs(coupled_columns(robot.chain, holding))
    worst = int(np.argmax(tau / tau_max))
    if not tau[worst] > tau_max[worst]:
        return ""
    return (
        f"{robot.joints[worst]} needs {tau[worst]:.3g} N m to hold the arm at rest here, beyond its limit of "
        f"{tau_max[worst]:.3g} N m, so the arm may sink; choose another posture, or correct the payload, the "
        "masses or robot.with_limits(tau_max=...)"
    )


def warn_of_weight(robot: Robot, q: FloatArray | None, tau_max: FloatArray) -> None:
    """One warning on the logger ``ftqp`` where a motor cannot hold the arm at rest at q, or at neutral."""
    if sentence := weight_sentence(robot, robot.neutral if q is None else q, tau_max):
        _LOG.warning("%s: %s", robot.name, sentence)


def warn_of_rotors(robot: Robot) -> None:
    """One warning on the logger ``ftqp`` where torques go to joints whose rotors the model lacks."""
    without = [joint for joint, rotor in zip(robot.joints, robot.chain.armature, strict=True) if not rotor]
    if without:
        _LOG.warning(
            "%s: no rotor inertia%s is in the model, and behind a gear it can be most of what a joint "
            "accelerates; it is learned while the arm moves, and better known from the start: give it by "
            "robot.with_rotors(...), armature in MJCF, or drake:rotor_inertia and drake:gear_ratio in URDF",
            robot.name,
            f" of {', '.join(without)}" if len(without) < robot.nv else "",
        )
