"""How a base really moves in a run."""

from collections.abc import Iterable
from typing import final

import numpy as np

from ftqp.core.checks import FloatArray, positive
from ftqp.core.errors import unknown
from ftqp.core.pose import rotation_vectors
from ftqp.sim.base.carriers import Base
from ftqp.sim.base.disturbances import Disturbance


@final
class BaseMotion:
    """How a base really moves in a run: its pose at every tick, its mean twist in every sample.

    Args:
        base: the base.
        disturbances: what moves it; deviations of the same coordinate add up.
        dt: sampling period [s].
        ticks: how many ticks the run has.

    Attributes:
        eta: coordinates at the ticks, (ticks, count) [m or rad].
        pose: of B in I at the ticks, (ticks, 4, 4).
        twist: mean twist at B's origin along I over the sample that begins at each tick, (ticks, 6) [m/s,
            rad/s].

    Raises:
        InputError: a disturbance of a coordinate that the base has not.
    """

    def __init__(self, base: Base, disturbances: Iterable[Disturbance], dt: float, ticks: int) -> None:
        step = positive("dt", dt, "s")
        names = base.coordinates
        t: FloatArray = np.arange(ticks + 1, dtype=np.float64) * step
        eta = np.zeros((ticks + 1, len(names)))
        for disturbance in disturbances:
            for name, value in disturbance.sample(t).items():
                if name not in names:
                    raise unknown("coordinate", name, "the base", names)
                eta[:, names.index(name)] += value
        poses = base.pose(eta)
        self.eta, self.pose = eta[:-1], poses[:-1]
        self.twist: FloatArray = np.zeros((ticks, 6))
        self.twist[:, :3] = np.diff(poses[:, :3, 3], axis=0) / step
        turns = poses[1:, :3, :3] @ np.swapaxes(poses[:-1, :3, :3], 1, 2)
        self.twist[:, 3:] = rotation_vectors(turns) / step
