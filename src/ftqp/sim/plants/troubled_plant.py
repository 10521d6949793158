"""What befalls an arm and nobody announces: hidden faults of joints, pushes, and holds of the whole arm."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from types import MappingProxyType
from typing import Any, Final, final

import numpy as np

from ftqp.core.checks import FloatArray, array, non_negative, positive
from ftqp.core.errors import InputError
from ftqp.core.setting import REQUIRED, refuse_out_of_range, setting
from ftqp.faults.kinds import Fault, Locked
from ftqp.model.robot import Robot
from ftqp.sim.plants.plant import Command, Plant, PlantAround
from ftqp.sim.schedule import first_tick


@dataclass(frozen=True, slots=True)
class Runaway:
    """The motor gives all its torque in one direction, whatever its servo asks.

    Args:
        joint: The joint's name or its 0-based index.
        direction: 1 or -1, that of the torque.
    """

    joint: str | int
    direction: int = setting(1)

    def __post_init__(self) -> None:
        if self.direction not in (-1, 1):
            raise InputError(f"direction of a runaway joint is {self.direction!r}, expected 1 or -1")


@dataclass(frozen=True, slots=True)
class Weakened:
    """The motor gives a share of whatever its servo asks, at every instant.

    `ftqp.Degraded` lowers the torque limit, which nobody sees before more than that is asked.

    Args:
        joint: The joint's name or its 0-based index.
        share: What is left, >= 0: 0 is a dead motor of which the servo does not know, 1 a healthy one.
    """

    joint: str | int
    share: float = setting(0.5, least=0.0)

    def __post_init__(self) -> None:
        non_negative("share of a weakened motor", self.share)


@dataclass(frozen=True, slots=True)
class Jammed:
    """The brake closes while the motor goes on pushing; `ftqp.Locked` switches the motor off.

    Args:
        joint: The joint's name or its 0-based index.
        share: What the brake holds, as a share of the joint's torque limit, >= 0; with less than the motor
            and its load give the joint slips. None is what the brakes of the arm hold.
    """

    joint: str | int
    share: float | None = setting(None, least=0.0)

    def __post_init__(self) -> None:
        if self.share is not None:
            non_negative("share of a brake", self.share)


@dataclass(frozen=True, slots=True)
class Misread:
    """The encoder that the servo of a joint reads is wrong, so that the servo follows what is not there.

    What a planner is given is the business of `ftqp.JointSensors`. A torque arm has no servo to mislead.

    Args:
        joint: The joint's name or its 0-based index.
        bias: Added to the true position [rad or m].
        frozen: Whether the servo reads the position of now for ever, at rest.
    """

    joint: str | int
    bias: float = setting(0.0, unit="rad or m")
    frozen: bool = setting(False)

    def __post_init__(self) -> None:
        if not isfinite(self.bias):
            raise InputError(f"bias of a misread encoder is {self.bias}, expected a finite angle or length")


@dataclass(frozen=True, slots=True, kw_only=True)
class Push:
    """Something pushes the tip; no joint has failed.

    Args:
        force: Along the axes of the base, (3,) [N].
    """

    force: tuple[float, float, float] = setting((0.0, 0.0, 0.0), unit="N")

    def __post_init__(self) -> None:
        array("force of a push", self.force, (3,))


HiddenFault = Runaway | Weakened | Jammed | Misread
"""Any fault."""
TROUBLES: Final[Mapping[str, type[Any]]] = MappingProxyType(
    {"runaway": Runaway, "weakened": Weakened, "jammed": Jammed, "misread": Misread, "push": Push}
)
"""All of them, and a push, by the names that scenarios give them."""


@final
@dataclass(frozen=True, slots=True)
class Hold:
    """All joints stand at once, and follow again later; nobody announces it: ``Hold(2.0, 0.5)``."""

    at: float = setting(REQUIRED, "when it happens, >= 0", unit="s", least=0.0)
    duration: float = setting(REQUIRED, "for how long, > 0", unit="s", above=0.0)

    def __post_init__(self) -> None:
        refuse_out_of_range(self, " of the hold")


@final
class HeldPlant(PlantAround):
    """Another plant whose joints all lock with every hold; what befell one meanwhile befalls it later."""

    __slots__ = ("_failed", "_robot", "_spans")

    def __init__(self, plant: Plant, robot: Robot, dt: float, holds: Sequence[Hold]) -> None:
        if plant.drive is None:
            raise InputError(
                "this plant follows its commands exactly, so nothing can hold it; take plant 'servo' with a "
                "base that stands, or 'mujoco'"
            )
        super().__init__(plant)
        self._robot = robot
        self._spans = [(first_tick(one.at, dt), first_tick(one.at + one.duration, dt)) for one in holds]
        self._failed: dict[int, Fault] = {}

    def reset(self, q: FloatArray, v: FloatArray) -> None:
        super().reset(q, v)
        self._failed.clear()

    def fail(self, fault: Fault) -> None:
        """From now on, or when the hold is over, the joint of ``fault`` behaves as it says."""
        self._failed[self._leader(fault.joint)] = fault
        if not self._is_held(self._tick):
            self._plant.fail(fault)

    def repair(self, joint: str | int) -> None:
        """From now on, or when the hold is over, the joint works as if it had never failed."""
        self._failed.pop(self._leader(joint), None)
        if not self._is_held(self._tick):
            self._plant.repair(joint)

    def _leader(self, joint: str | int) -> int:
        return int(self._robot.chain.lead[self._robot.joint(joint)])

    def _is_held(self, tick: int) -> bool:
        return any(begin <= tick < end for begin, end in self._spans)

    def advance(self, command: Command) -> None:
        held = self._is_held(self._tick)
        if held != self._is_held(self._tick - 1):
            for i in range(self._robot.nv):
                fault = self._failed.get(self._leader(i))
                if isinstance(fault, Locked):  # stands already, or a brake has closed meanwhile
                    continue
                if held:
                    self._plant.fail(Locked(i, mode="instant"))
                    continue
                self._plant.repair(i)
                if fault is not None:
                    self._plant.fail(fault)
        super().advance(command)


NEVER = 2**62
"""No run has so many ticks."""


@final
@dataclass(frozen=True, slots=True)
class Trouble:
    """Something befalls the arm: ``Trouble(2.0, Jammed(3), 0.1)``; without a duration it stays."""

    at: float  # When it happens, >= 0 [s]
    what: HiddenFault | Push
    duration: float | None = None  # For how long, > 0 [s]; a joint works again afterwards
    every: float | None = None  # It comes again whenever so much time is over, > duration [s]

    def __post_init__(self) -> None:
        non_negative("time of the trouble", self.at, "s")
        if self.duration is not None:
            positive("duration of the trouble", self.duration, "s")
        if self.every is not None and not self.every > (self.duration or np.inf):
            raise InputError(
                f"trouble comes again every {self.every:g} s, expected more than its duration, "
                f"{'which it has not' if self.duration is None else f'{self.duration:g} s'}"
            )


@final
class TroubledPlant(PlantAround):
    """A plant in physics, and what befalls it; a joint whose trouble is over works as it did before."""

    __slots__ = ("_physics", "_spans")

    def __init__(self, plant: Any, robot: Robot, dt: float, troubles: Sequence[Trouble]) -> None:
        super().__init__(plant)
        self._physics = plant
        self._spans: list[tuple[int, int, int, HiddenFault | Push]] = []
        for one in troubles:
            if not isinstance(one.what, Push):
                robot.joint(one.what.joint)
            first = first_tick(one.at, dt)
            ticks = NEVER if one.duration is None else max(1, round(one.duration / dt))
            period = NEVER if one.every is None else max(ticks + 1, round(one.every / dt))
            self._spans.append((first, ticks, period, one.what))

    def reset(self, q: FloatArray, v: FloatArray) -> None:
        super().reset(q, v)
        self._physics.push(np.zeros(3))

    def advance(self, command: Command) -> None:
        for first, ticks, period, what in self._spans:
            since = (self._tick - first) % period if self._tick >= first else -1
            if isinstance(what, Push):
                if since in (0, ticks):
                    self._physics.push(what.force if since == 0 else np.zeros(3))
            elif since == 0:
                self._physics.suffer(what)
            elif since == ticks:
                self._plant.repair(what.joint)
        super().advance(command)
