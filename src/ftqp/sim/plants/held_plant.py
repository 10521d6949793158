"""An arm that is held as a whole for a while, as by a protective stop, whatever it is sent."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.core.setting import REQUIRED, refuse_out_of_range, setting
from ftqp.faults.kinds import Fault, Locked
from ftqp.model.robot import Robot
from ftqp.sim.plants.plant import Command, Plant, PlantAround
from ftqp.sim.schedule import first_tick


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
