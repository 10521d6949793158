"""Frames of a robot beside its tip: where they are, which joint they move with, and the joints on the way."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, final

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray, IntArray
from ftqp.core.errors import InputError
from ftqp.core.pose import transform
from ftqp.model.reduction import named_frame


def centre_of_mass(robot: Any, q: Any) -> FloatArray:
    """Centre of mass of all bodies in the world, (3,) [m], at joint values q, (nv,) or (nq,)."""
    return np.array(pin.centerOfMass(robot.model, robot.model.createData(), robot.configuration(q)))


def mount_of(robot: Any, name: str) -> tuple[int, FloatArray]:
    """The joint that a frame moves with, -1 is none, and its pose (4, 4) in the chain's frame of that."""
    T = robot.pose(np.zeros(robot.nv), name)
    body = int(robot.model.frames[named_frame(robot.model, name)].parentJoint) - 1
    chain, W = robot.chain, np.eye(4)
    for i in chain.way(body):
        W = W @ transform(chain.rotation[i], chain.translation[i])
    return body, np.array(np.linalg.solve(W, T), dtype=np.float64)


def joint_of_frames(robot: Any) -> dict[str, str | None]:
    """Names of all frames, links and joints of a robot's model, each with the joint that it moves with."""
    model = robot.model
    found: dict[str, str | None] = {}
    for frame in model.frames:  # of two frames of one name the first is meant
        found.setdefault(frame.name, str(model.names[frame.parentJoint]) if frame.parentJoint else None)
    return found


@final
class PlacedFrames:
    """Poses of some frames of a robot, posture after posture."""

    def __init__(self, robot: Any, names: Sequence[str]) -> None:
        self._robot, self._data = robot, robot.model.createData()
        self._numbers = [named_frame(robot.model, name) for name in names]

    def at(self, q: FloatArray) -> FloatArray:
        """Their poses in the world, (count, 4, 4) [m], at joint positions q, (nv,) [rad or m]."""
        model, data = self._robot.model, self._data
        pin.forwardKinematics(model, data, self._robot.configuration(q))
        poses = [pin.updateFramePlacement(model, data, number).homogeneous for number in self._numbers]
        return np.array(poses).reshape(-1, 4, 4)


def way_to(robot: Any, frame: str) -> IntArray:
    """The joints on the way from the base to a frame of a robot, and those that they follow, base first."""
    body = int(robot.model.frames[named_frame(robot.model, frame)].parentJoint) - 1
    way = robot.chain.way(body)
    return np.unique([*way, *robot.chain.lead[way]])


def on_way(robot: Any, frame: str, q: Any, name: str = "q") -> FloatArray:
    """The joints on the way to a frame in positions of all, (..., nv) [rad or m]."""
    given = np.asarray(q, dtype=np.float64)
    if given.ndim not in (1, 2) or given.shape[-1] != robot.nv:
        raise InputError(
            f"{name} has shape {given.shape}, expected (N + 1, nv) = (N + 1, {robot.nv}), or (nv,)"
        )
    return np.ascontiguousarray(given[..., way_to(robot, frame)])


def off_way(robot: Any, frame: str, q: FloatArray, others: FloatArray) -> FloatArray:
    """Positions of all joints, (..., nv): those on the way to a frame as given, the others as in (nv,)."""
    whole = np.array(np.broadcast_to(others, (*q.shape[:-1], robot.nv)))
    whole[..., way_to(robot, frame)] = q
    return whole


def faults_on_way(robot: Any, frame: str, faults: Iterable[Any]) -> tuple[Any, ...]:
    """The faults of joints on the way to a frame, each by its joint's name."""
    way = way_to(robot, frame)
    return tuple(
        replace(fault, joint=robot.joints[robot.joint(fault.joint)])
        for fault in faults
        if robot.joint(fault.joint) in way
    )
