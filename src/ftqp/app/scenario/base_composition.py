"""Makes the moving base of a run from the table ``[base]``."""

from pathlib import Path as File

import numpy as np

from ftqp.app.schema.base_section import (
    BaseTable,
    DisturbanceTable,
    PlatformTable,
    RandomTable,
    RecordedTable,
    SinusoidTable,
    StepTable,
)
from ftqp.control.moving_base.base_gain import Observer
from ftqp.control.moving_base.inertial_task import InertialTask, MovingBase
from ftqp.control.planner.planner import Planner
from ftqp.core.errors import InputError
from ftqp.sim.base.carriers import Base, FreeBase, Platform
from ftqp.sim.base.disturbances import Disturbance, RandomMotion, Sinusoid, Step
from ftqp.sim.base.motion_file import recorded_motion
from ftqp.sim.base.moving_world import MovingWorld


def moving_base(table: BaseTable) -> MovingBase:
    """What the controller knows of the base.

    Raises:
        InputError: Settings that do not fit together.
    """
    observer = None if table.observer is None else Observer(**table.observer.model_dump())
    return MovingBase(
        sensing=table.sensing,
        attitude=table.attitude,
        observer=observer,
        delay=table.delay,
        patience=table.patience,
        anti_windup=table.anti_windup,
    )


def world(table: BaseTable, planner: Planner, folder: File, seed: int) -> MovingWorld:
    """The base under the planner's arm, and the sensors; files are relative to ``folder``.

    Raises:
        InputError: a coordinate that this base has not, a recording that cannot be used, a planner that does
            not fit.
    """
    base = _body(table)
    generator = np.random.default_rng(seed)
    return MovingWorld(
        InertialTask(planner, moving_base(table), gain=table.gain),
        base,
        [_disturbance(each, base, folder, generator) for each in table.disturbances],
        end_point=table.end_point,
        position_noise=table.noise.position,
        rotation_noise=table.noise.rotation,
        seed=int(generator.integers(2**63)),
    )


def _body(table: BaseTable) -> Base:
    if isinstance(table, PlatformTable):
        x, y, z = table.mount
        return Platform(table.height, (x, y, z))
    return FreeBase()


def _disturbance(
    table: DisturbanceTable, base: Base, folder: File, generator: np.random.Generator
) -> Disturbance:
    if not isinstance(table, RecordedTable) and table.coordinate not in base.coordinates:
        raise InputError(
            f"{table.coordinate!r} is not a coordinate of this base; it has {', '.join(base.coordinates)}"
        )
    match table:
        case StepTable():
            return Step(table.coordinate, table.size, at=table.at, rate=table.rate)
        case SinusoidTable():
            return Sinusoid(table.coordinate, table.amplitude, frequency=table.frequency, phase=table.phase)
        case RandomTable():
            return RandomMotion(table.coordinate, table.rms, corner=table.corner, generator=generator)
        case RecordedTable():
            return recorded_motion(folder / table.file, base.coordinates)
