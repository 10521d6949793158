"""An arm in physics that suffers at set times what nobody announces: hidden faults of joints, and pushes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from ftqp.core.checks import FloatArray, non_negative, positive
from ftqp.core.errors import InputError
from ftqp.model.robot import Robot
from ftqp.sim.plants.hidden_faults import HiddenFault, Push
from ftqp.sim.plants.mujoco_plant import MujocoPlant
from ftqp.sim.plants.plant import Command, PlantAround
from ftqp.sim.schedule import first_tick

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

    def __init__(self, plant: MujocoPlant, robot: Robot, dt: float, troubles: Sequence[Trouble]) -> None:
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
