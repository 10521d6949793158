"""The serial arm on the way from the base to one frame of a tree."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.core.errors import InputError
from ftqp.model.followers import followers_of
from ftqp.model.limits import JointLimits
from ftqp.model.reduction import named_frame


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


def wishes_of(robot: Any, frame: str) -> dict[str, Any]:
    """What ``Robot.from_pinocchio`` is told so that it makes the arm on that way.

    Joints beside the way are held where ``neutral`` has them; limits, rows and length stay.
    """
    way = way_to(robot, frame)
    limits = JointLimits(
        **{
            name: getattr(robot.limits, name)[way]
            for name in ("q_min", "q_max", "v_max", "a_max", "tau_max", "j_max")
        }
    )
    held = np.setdiff1d(np.arange(robot.nv), way)
    led = followers_of(robot.joints, robot.chain)
    return {
        "tip": frame,
        "locked": [robot.joints[i] for i in held],
        "q_locked": {robot.joints[i]: float(robot.neutral[i]) for i in held},
        "limits": limits,
        "neutral": robot.neutral[way],
        "default_rows": robot.default_rows,
        "length": robot.length,
        "name": robot.name,
        "mimics": {
            name: (one.leader, one.ratio, one.offset) for name, one in led.items() if robot.joint(name) in way
        },
    }
