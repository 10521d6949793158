"""Where some frames of a robot and its centre of mass are, posture after posture."""

from collections.abc import Sequence
from typing import final

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray
from ftqp.model.reduction import named_frame
from ftqp.model.robot import Robot


def joint_of_frames(robot: Robot) -> dict[str, str | None]:
    """Names of all frames, links and joints of a robot's model, each with the joint that it moves with.

    None stands for a frame that does not move.
    """
    model = robot.model
    found: dict[str, str | None] = {}
    for frame in model.frames:  # of two frames of one name the first is meant
        found.setdefault(frame.name, str(model.names[frame.parentJoint]) if frame.parentJoint else None)
    return found


@final
class PlacedFrames:
    """Poses of some frames of a robot's model.

    Args:
        robot: The robot.
        names: Of the frames, links or joints.

    Raises:
        InputError: The model has no such frame.
    """

    def __init__(self, robot: Robot, names: Sequence[str]) -> None:
        self._robot, self._data = robot, robot.model.createData()
        self._numbers = [named_frame(robot.model, name) for name in names]

    def at(self, q: FloatArray) -> FloatArray:
        """Their poses in the world, (count, 4, 4) [m].

        Args:
            q: Joint positions, (nv,) [rad or m].
        """
        model, data = self._robot.model, self._data
        pin.forwardKinematics(model, data, self._robot.configuration(q))
        poses = [pin.updateFramePlacement(model, data, number).homogeneous for number in self._numbers]
        return np.array(poses).reshape(-1, 4, 4)

    def centre_of_mass(self, q: FloatArray) -> FloatArray:
        """The centre of mass of all bodies in the world, (3,) [m].

        Args:
            q: Joint positions, (nv,) [rad or m].
        """
        configuration = self._robot.configuration(q)
        return np.array(pin.centerOfMass(self._robot.model, self._data, configuration))
