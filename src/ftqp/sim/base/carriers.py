"""Bases that move: a platform of three joints and a free body, what disturbs them, and what is measured of
them."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import final

import numpy as np
from scipy.spatial.transform import Rotation

from ftqp.core.checks import FloatArray, non_negative, positive
from ftqp.core.errors import unknown
from ftqp.sim.base.disturbances import Disturbance


class Base(ABC):
    """The role of a base: coordinates eta, and the pose of the arm's base frame B in the inertial frame I."""

    @property
    @abstractmethod
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates."""

    @abstractmethod
    def pose(self, eta: FloatArray) -> FloatArray:
        """Poses of B in I, (K, 4, 4) [m], at coordinates eta, (K, count) [m or rad]."""


@final
class Platform(Base):
    """Three joints: ``track`` along x0, ``rotation`` about z0 on the carriage, ``tilt`` about the carried y
    axis.

    Args:
        height: of the tilt axis above the track [m].
        mount: position of B in the tilted frame, (3,) [m].

    Source: Holt and Desrochers, NASA N94-26281, for the joints; they give no dimensions, so the lengths are
    choices.
    """

    def __init__(self, height: float = 0.30, mount: tuple[float, float, float] = (0.20, 0.0, 0.45)) -> None:
        self._height = non_negative("height", height, "m")
        self._mount = np.array(mount, dtype=np.float64)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates."""
        return ("track", "rotation", "tilt")

    def pose(self, eta: FloatArray) -> FloatArray:
        """Tx(track) Rz(rotation) Tz(height) Ry(tilt) T(mount) at eta, (K, 3) [m, rad, rad]."""
        turn = Rotation.from_euler("ZY", eta[:, 1:3])
        poses = np.tile(np.eye(4), (len(eta), 1, 1))
        poses[:, :3, :3] = turn.as_matrix()
        poses[:, :3, 3] = turn.apply(self._mount)
        poses[:, 0, 3] += eta[:, 0]
        poses[:, 2, 3] += self._height
        return poses


@final
class FreeBase(Base):
    """Six degrees of freedom: position ``x, y, z`` and rotation vector ``rx, ry, rz`` of B in I."""

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates."""
        return ("x", "y", "z", "rx", "ry", "rz")

    def pose(self, eta: FloatArray) -> FloatArray:
        """Poses at eta, (K, 6) [m, rad]."""
        poses = np.tile(np.eye(4), (len(eta), 1, 1))
        poses[:, :3, :3] = Rotation.from_rotvec(eta[:, 3:]).as_matrix()
        poses[:, :3, 3] = eta[:, :3]
        return poses


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
        self.twist[:, 3:] = Rotation.from_matrix(turns).as_rotvec() / step


@final
class PoseSensor:
    """Measures a pose in I with white noise, some samples late.

    Args:
        position: standard deviation of each axis [m].
        rotation: standard deviation about each axis [rad].
        late: samples of delay.
        generator: where the noise comes from.
    """

    def __init__(
        self,
        *,
        position: float = 0.0,
        rotation: float = 0.0,
        late: int = 0,
        generator: np.random.Generator | None = None,
    ) -> None:
        self._position = non_negative("position noise", position, "m")
        self._rotation = non_negative("rotation noise", rotation, "rad")
        self._generator = np.random.default_rng(0) if generator is None else generator
        self._waiting: list[FloatArray] = []
        self._late = int(non_negative("delay of the sensor", late))

    def reset(self) -> None:
        """Forget what has been seen."""
        self._waiting.clear()

    def measure(self, truth: FloatArray) -> FloatArray:
        """What is measured now, (4, 4), the true pose being ``truth``, (4, 4); before the first delay its
        first."""
        seen = truth.copy()
        if self._position > 0.0:
            seen[:3, 3] += self._position * self._generator.standard_normal(3)
        if self._rotation > 0.0:
            noise = Rotation.from_rotvec(self._rotation * self._generator.standard_normal(3)).as_matrix()
            seen[:3, :3] = noise @ seen[:3, :3]
        self._waiting.append(seen)
        if len(self._waiting) > self._late + 1:
            self._waiting.pop(0)
        return self._waiting[0]
