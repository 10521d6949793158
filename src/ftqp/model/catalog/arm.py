"""How every arm of the catalog is put together from its figures."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.model.build import ROWS
from ftqp.model.capsules import Capsule
from ftqp.model.limits import JointLimits
from ftqp.model.robot import Robot
from ftqp.model.serial import EARTH, Body, Inertial, serial_model


def arm(
    name: str,
    joints: Sequence[str],
    placements: Sequence[FloatArray],
    inertials: Sequence[Inertial] | None,
    limits: Mapping[str, Any],
    *,
    tip: str,
    tip_pose: FloatArray,
    payload: Sequence[tuple[FloatArray, Inertial]] = (),
    neutral: Any = None,
    default_rows: Sequence[str] = ROWS,
    length: float | None = None,
    gravity: Sequence[float] = EARTH,
    rotors: float = 0.0,
    continuous: bool = False,
    capsules: Sequence[Capsule] = (),
) -> Robot:
    """A robot of revolute joints about their z axes.

    Args:
        name: The robot's name.
        joints: Joint names, (n,).
        placements: Joint frame i in joint frame i-1 at q = 0, (n, 4, 4).
        inertials: Masses of the links, in the frames of their joints, (n,); None: unknown.
        limits: Fields of ``JointLimits`` of the joints, each (n,) or one number; without ``a_max`` the rule
            of ``RISE_TIME`` holds and a finding says so.
        tip: Name of the tip frame.
        tip_pose: Pose of the tip in the last joint's frame, (4, 4).
        payload: Rigid bodies behind the last joint, each with its frame's pose in the last joint's frame.
        neutral: a configuration inside the limits, (n,) [rad].
        default_rows: Task rows the robot is meant for.
        length: Characteristic length [m]; None: a sixth of the reach.
        gravity: Gravity in the base frame, (3,) [m/s2].
        rotors: Rotor inertia seen at every joint [kg m2].
        continuous: Whether every joint turns without end; the limits then have no positions.
        capsules: The links, each in the frame of its joint; none are estimated from the joints.
    """
    bodies = []
    for i, (joint, place) in enumerate(zip(joints, placements, strict=True)):
        parts = [] if inertials is None else [(np.eye(4), inertials[i])]
        parts += payload if i == len(joints) - 1 else []
        bodies.append(Body(name=joint, placement=place, continuous=continuous, parts=parts))
    written = JointLimits.of(len(joints), **limits)
    model = serial_model(name, bodies, written, frames=[(tip, tip_pose)], gravity=gravity)
    model.armature = np.full(model.nv, rotors)
    made = Robot.from_pinocchio(
        model, tip, limits=limits, neutral=neutral, default_rows=default_rows, length=length
    )
    return made.with_capsules(capsules) if capsules else made


def links(
    table: Sequence[tuple[str, str, Sequence[float], Sequence[float], float]],
) -> list[Capsule]:
    """Capsules from a table of name, frame, both ends [m] and radius [m]."""
    return [Capsule(a, b, radius, frame=frame, name=name) for name, frame, a, b, radius in table]
