"""Frames of a robot's model beside its tip: where they are, and which joint they move with."""

from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray
from ftqp.core.pose import transform
from ftqp.model.chain import configuration_of
from ftqp.model.reduction import named_frame
from ftqp.model.robot import Robot


def frame_pose(robot: Robot, name: str, q: Any) -> FloatArray:
    """Pose of a frame in the world, (4, 4) [m], at joint values q, (nv,) or (nq,)."""
    return robot.pose(q, name)


def centre_of_mass(robot: Robot, q: Any) -> FloatArray:
    """Centre of mass of all bodies in the world, (3,) [m], at joint values q, (nv,) or (nq,)."""
    return np.array(pin.centerOfMass(robot.model, robot.model.createData(), robot.configuration(q)))


def base_wrenches(robot: Robot, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
    """The force and the torque that the base bears on a motion, about its origin, (k, 2) [N, N m].

    They hold the arm's weight and make its bodies accelerate; rotors, which spin beside, are left out.

    Args:
        robot: The arm with its load.
        q: Joint values, (k, nv).
        v: Their velocities, (k, nv).
        a: Their accelerations, (k, nv).

    Source: Featherstone 2008, section 5.3.
    """
    model, data = robot.model, robot.model.createData()
    roots = [int(i) for i in model.children[0]]
    sizes = np.empty((len(q), 2))
    for row, place, speed, change in zip(sizes, q, v, a, strict=True):
        pin.rnea(model, data, configuration_of(model, robot.continuous, place), speed, change)
        borne = sum((data.liMi[i].act(data.f[i]).vector for i in roots), np.zeros(6))
        row[:] = np.linalg.norm(borne[:3]), np.linalg.norm(borne[3:])
    return sizes


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
