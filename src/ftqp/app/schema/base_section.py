"""The table ``[base]``: what carries the arm, what moves it, what is measured of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path as File
from typing import Any

import numpy as np

from ftqp.app.schema.reading import Options, Table, settings_for
from ftqp.control.moving_base.base_gain import Observer
from ftqp.control.moving_base.inertial_task import InertialTask, MovingBase
from ftqp.control.planner.planner import Planner
from ftqp.core.errors import InputError
from ftqp.core.setting import REQUIRED, like, setting
from ftqp.sim.base.disturbances import Disturbance, RandomMotion, Sinusoid, Step
from ftqp.sim.base.moving_world import Base, FreeBase, MovingWorld, Platform
from ftqp.sim.number_files import recorded_motion


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionFile:
    """A recorded motion, read from a CSV file with a header.

    The columns are t [s] and the coordinates of the base; a free base has qx, qy, qz, qw for its attitude.
    """

    file: str = setting(REQUIRED, "a .csv file, relative to the scenario", file=True)


DISTURBANCES: Mapping[str, type[Any]] = {
    "step": Step, "sinusoid": Sinusoid, "random": RandomMotion, "recorded": MotionFile
}  # fmt: skip
CARRIERS: Mapping[str, type[Base]] = {"platform": Platform, "free": FreeBase}


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseTable(Table):
    """White noise of every measured pose."""

    position: float = setting(0.0, "of each axis, >= 0", unit="m", least=0.0)
    rotation: float = setting(0.0, "about each axis, >= 0", unit="rad", least=0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseTable(Table):
    """What carries the arm."""

    disturbances: tuple[Options[Disturbance], ...] = setting((), "what moves the base", kinds=DISTURBANCES)
    sensing: str = like(MovingBase, "sensing")
    attitude: str = like(MovingBase, "attitude")
    gain: float = setting(1.0, "share of the error that a step removes, 0 < x < 2", above=0.0, below=2.0)
    observer: Options[Observer] | None = like(MovingBase, "observer")
    delay: float = like(MovingBase, "delay")
    end_point: bool | None = setting(None, "whether the tip is measured; when the base is not, if absent")
    noise: NoiseTable = setting(NoiseTable(), "noise of every measured pose")
    patience: float = like(MovingBase, "patience")
    anti_windup: bool = like(MovingBase, "anti_windup")
    kind: Options[Base] = setting(REQUIRED, "kind of base", kinds=CARRIERS)

    def world(self, planner: Planner, folder: File, seed: int) -> MovingWorld:
        """The base under the planner's arm, and the sensors; files are relative to ``folder``."""
        base, generator = self.kind.made(), np.random.default_rng(seed)
        return MovingWorld(
            InertialTask(planner, MovingBase(**settings_for(MovingBase, self)), gain=self.gain),
            base,
            [_disturbance(each, base, folder, generator) for each in self.disturbances],
            end_point=self.end_point,
            position_noise=self.noise.position,
            rotation_noise=self.noise.rotation,
            seed=int(generator.integers(2**63)),
        )


def _disturbance(
    given: Options[Any], base: Base, folder: File, generator: np.random.Generator
) -> Disturbance:
    if given.of is MotionFile:
        return recorded_motion(folder / given["file"], base.coordinates)
    if given["coordinate"] not in base.coordinates:
        raise InputError(
            f"{given['coordinate']!r} is not a coordinate of this base; it has {', '.join(base.coordinates)}"
        )
    moved: Disturbance = given.made(**({"generator": generator} if given.of is RandomMotion else {}))
    return moved
