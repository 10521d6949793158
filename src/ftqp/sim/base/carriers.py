"""What carries an arm that moves: a platform of three joints, or a free body."""

from abc import ABC, abstractmethod
from typing import ClassVar, final

import numpy as np

from ftqp.core.checks import FloatArray, non_negative
from ftqp.core.setting import Setting, Settings


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
    """Three joints: ``track`` along x0, ``rotation`` about z0 on the carriage, ``tilt`` about its y axis.

    Source: Holt and Desrochers 1994 for the joints; they give no dimensions, so the lengths are choices.
    """

    settings: ClassVar[Settings] = {
        "height": Setting("of the tilt axis, >= 0", unit="m", least=0.0),
        "mount": Setting("of the arm in the tilted frame", unit="m"),
    }

    def __init__(self, height: float = 0.30, mount: tuple[float, float, float] = (0.20, 0.0, 0.45)) -> None:
        self._height = non_negative("height", height, "m")
        self._mount = np.array(mount, dtype=np.float64)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates."""
        return ("track", "rotation", "tilt")

    def pose(self, eta: FloatArray) -> FloatArray:
        """Tx(track) Rz(rotation) Tz(height) Ry(tilt) T(mount) at eta, (K, 3) [m, rad, rad]."""
        from scipy.spatial.transform import Rotation  # slow to load, needed where the base moves

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
        from scipy.spatial.transform import Rotation  # slow to load, needed where the base moves

        poses = np.tile(np.eye(4), (len(eta), 1, 1))
        poses[:, :3, :3] = Rotation.from_rotvec(eta[:, 3:]).as_matrix()
        poses[:, :3, 3] = eta[:, :3]
        return poses
