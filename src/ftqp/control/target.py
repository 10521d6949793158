"""Target: where the tip should be, packed as the kernel reads it."""

from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, array
from ftqp.core.errors import InputError
from ftqp.core.pose import pose as checked_pose
from ftqp.kernel.codes import (
    TARGET_ACCELERATION,
    TARGET_HAS_ROTATION,
    TARGET_POSE,
    TARGET_SIZE,
    TARGET_TWIST,
)


class Target:
    """Pose (or position), twist and acceleration that the tip should have now.

    The arrays are views of one buffer: write into them between steps (``target.pose[:] = T``) instead of making a new
    target every tick. What is written there is not checked; a NaN gives the status INVALID_INPUT.

    Args:
        pose: (4, 4) homogeneous transform, or anything with ``.homogeneous``; tip in the base frame W.
        position: (3,) [m], instead of a pose, for tasks without rotation rows.
        twist: (6,) linear [m/s] then angular [rad/s] along W; (3,) with a position; None is zero.
        acceleration: as the twist, [m/s2], [rad/s2].

    Attributes:
        pose: (4, 4). position: (3,). twist: (6,). acceleration: (6,). packed: (29,) all of them.

    Raises:
        InputError: neither or both of pose and position, a wrong shape, or not finite.
    """

    __slots__ = ("acceleration", "packed", "pose", "position", "twist")

    def __init__(
        self,
        pose: Any = None,
        position: Any = None,
        twist: Any = None,
        acceleration: Any = None,
    ) -> None:
        if (pose is None) == (position is None):
            raise InputError("a target needs exactly one of pose and position; a pose gives both position and rotation")
        self.packed: FloatArray = np.zeros(TARGET_SIZE)
        self.pose = self.packed[TARGET_POSE:TARGET_TWIST].reshape(4, 4)
        self.position = self.pose[:3, 3]
        self.twist = self.packed[TARGET_TWIST:TARGET_ACCELERATION]
        self.acceleration = self.packed[TARGET_ACCELERATION:TARGET_HAS_ROTATION]
        if position is None:
            self.pose[:] = checked_pose(pose, "pose")
            self.packed[TARGET_HAS_ROTATION] = 1.0
        else:
            self.pose[:] = np.eye(4)
            self.position[:] = array("position", position, (3,))
        for name, value, view in (("twist", twist, self.twist), ("acceleration", acceleration, self.acceleration)):
            if value is not None:
                short = position is not None and np.shape(value) == (3,)
                view[: 3 if short else 6] = array(name, value, (3,) if short else (6,))

    def __repr__(self) -> str:
        what = "pose" if self.packed[TARGET_HAS_ROTATION] else "position"
        return f"Target({what} at {np.array2string(self.position, precision=4)})"
