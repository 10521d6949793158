"""Frames of a robot's model beside its tip: where they are, and which joint they move with."""

from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, nearest
from ftqp.model.robot import Robot

SHOWN = 12
"""So many names of frames are told to whoever gives another one."""


def frame_number(robot: Robot, name: str) -> int:
    """pinocchio's number of a frame.

    Raises:
        InputError: The model has no such frame.
    """
    names = [frame.name for frame in robot.model.frames]
    if name not in names:
        more = ", ..." if len(names) > SHOWN else ""
        raise InputError(
            f"frame is {name!r:.60}{nearest(str(name), names)}, expected one of {robot.name}: "
            f"{', '.join(names[1:SHOWN])}{more}"
        )
    return names.index(name)


def frame_pose(robot: Robot, name: str, q: Any) -> FloatArray:
    """Pose of a frame in the world, (4, 4) [m], at joint values q, (nv,) or (nq,)."""
    model = robot.model
    data = model.createData()
    pin.forwardKinematics(model, data, robot.configuration(q))
    pin.updateFramePlacements(model, data)
    return np.array(data.oMf[frame_number(robot, name)].homogeneous)


def centre_of_mass(robot: Robot, q: Any) -> FloatArray:
    """Centre of mass of all bodies in the world, (3,) [m], at joint values q, (nv,) or (nq,)."""
    return np.array(pin.centerOfMass(robot.model, robot.model.createData(), robot.configuration(q)))


def mount_of(robot: Robot, name: str) -> tuple[int, FloatArray]:
    """The joint that a frame moves with, -1 is none, and its pose in the chain's frame of that joint, (4, 4).

    The chain's frames have their z axis along the joint, so that they are others than pinocchio's.
    """
    T = frame_pose(robot, name, np.zeros(robot.nv))
    body = int(robot.model.frames[frame_number(robot, name)].parentJoint) - 1
    constants, W = robot.chain.constants(), np.eye(4)
    for i in range(body + 1):
        step = np.eye(4)
        step[:3, :3] = np.reshape(constants["rotation"][i], (3, 3))
        step[:3, 3] = constants["translation"][i]
        W = W @ step
    return body, np.array(np.linalg.solve(W, T), dtype=np.float64)
