"""What befalls an arm and nobody announces: holds of the whole arm; hidden faults of joints, and pushes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import numpy as np

from ftqp.core.checks import FloatArray, non_negative, positive
from ftqp.core.errors import InputError
from ftqp.core.setting import REQUIRED, refuse_out_of_range, setting
from ftqp.faults.kinds import Fault, Locked
from ftqp.model.robot import Robot
from ftqp.sim.plants.hidden_faults import HiddenFault, Push
from ftqp.sim.plants.plant import Command, Plant, PlantAround
from ftqp.sim.schedule import first_tick

if TYPE_CHECKING:
    from ftqp.sim.plants.mujoco_plant import MujocoPlant


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

    def __init__(self, plant: "MujocoPlant", robot: Robot, dt: float, troubles: Sequence[Trouble]) -> None:
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
            if since == 0:
                self._begin(what)
            elif since == ticks:
                self._end(what)
        super().advance(command)

    def _begin(self, what: HiddenFault | Push) -> None:
        if isinstance(what, Push):
            self._physics.push(what.force)
        else:
            self._physics.suffer(what)

    def _end(self, what: HiddenFault | Push) -> None:
        if isinstance(what, Push):
            self._physics.push(np.zeros(3))
        else:
            self._plant.repair(what.joint)
