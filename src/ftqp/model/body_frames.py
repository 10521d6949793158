"""Frames of a robot's model beside its tip: where they are, and which joint they move with."""

from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray
from ftqp.core.pose import transform
from ftqp.model.reduction import named_frame
from ftqp.model.robot import Robot


def frame_pose(robot: Robot, name: str, q: Any) -> FloatArray:
    """Pose of a frame in the world, (4, 4) [m], at joint values q, (nv,) or (nq,)."""
    return robot.pose(q, name)


def centre_of_mass(robot: Robot, q: Any) -> FloatArray:
    """Centre of mass of all bodies in the world, (3,) [m], at joint values q, (nv,) or (nq,)."""
    return np.array(pin.centerOfMass(robot.model, robot.model.createData(), robot.configuration(q)))


def base_moments(robot: Robot, places: FloatArray) -> FloatArray:
    """The torque about the base's origin that holds the arm's weight at rest, |c x m g|, (k,) [N m].

    Args:
        robot: The arm with its load.
        places: Joint values, (k, nv).
    """
    model, data = robot.model, robot.model.createData()
    weight = pin.computeTotalMass(model) * np.asarray(model.gravity.linear)
    centres = [np.array(pin.centerOfMass(model, data, robot.configuration(q))) for q in places]
    result: FloatArray = np.linalg.norm(np.cross(np.array(centres), weight), axis=1)
    return result


def mount_of(robot: Robot, name: str) -> tuple[int, FloatArray]:
    """The joint that a frame moves with, -1 is none, and its pose in the chain's frame of that joint, (4, 4).

    The chain's frames have their z axis along the joint, so that they are others than pinocchio's.
    """
    T = robot.pose(np.zeros(robot.nv), name)
    body = int(robot.model.frames[named_frame(robot.model, name)].parentJoint) - 1
    chain, W = robot.chain, np.eye(4)
    for i in chain.way(body):
        W = W @ transform(chain.rotation[i], chain.translation[i])
    return body, np.array(np.linalg.solve(W, T), dtype=np.float64)
