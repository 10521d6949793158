"""A pinocchio model of a serial arm, built from a list of bodies or a table of DH parameters."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray, array
from ftqp.core.errors import InputError, unknown
from ftqp.core.pose import pose as checked_pose
from ftqp.core.pose import rotation_x, rotation_z, transform
from ftqp.model.limits import JointLimits

TIP = "tip"
"""Name of the tip frame of an arm from a table."""
EARTH = (0.0, 0.0, -9.81)
"""Gravity [m/s2] in a base frame whose z axis points up."""


def rotation_rpy(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Rz(yaw) Ry(pitch) Rx(roll), (3, 3): the fixed-axis convention of URDF [rad]."""
    return np.array(pin.rpy.rpyToMatrix(roll, pitch, yaw))


def placement(xyz: Sequence[float], rpy: Sequence[float] = (0.0, 0.0, 0.0)) -> FloatArray:
    """A transform (4, 4) from a translation [m] and roll, pitch, yaw [rad], as URDF writes an origin."""
    return transform(rotation_rpy(*rpy), np.array(xyz, dtype=np.float64))


def symmetric(xx: float, xy: float, xz: float, yy: float, yz: float, zz: float) -> FloatArray:
    """The symmetric matrix (3, 3) of an inertia's six figures in URDF's order."""
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inertial:
    """The mass of a rigid body.

    Attributes:
        mass: [kg].
        com: Centre of mass in the body's frame, (3,) [m].
        inertia: About the centre of mass, axes of the body's frame, (3, 3) [kg m2].
    """

    mass: float
    com: FloatArray
    inertia: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Body:
    """A joint about or along its z axis and the body behind it."""

    name: str  # The joint's name
    # Joint frame in the previous joint's frame (the base for the first) at q = 0, (4, 4)
    placement: FloatArray
    prismatic: bool = False  # Whether the joint slides
    # Whether the joint turns without end, so that pinocchio keeps its cosine and sine
    continuous: bool = False
    # Rigid bodies carried behind the joint, each with its frame's pose (4, 4) in the joint's frame
    parts: Sequence[tuple[FloatArray, Inertial]] = field(default=())


def serial_model(
    name: str,
    bodies: Sequence[Body],
    limits: JointLimits,
    *,
    frames: Sequence[tuple[str, FloatArray]],
    gravity: Sequence[float] = EARTH,
) -> Any:
    """A pinocchio model of the arm with its limits; ``frames`` are (4, 4) in the last joint's frame."""
    model = pin.Model()
    model.name = name
    model.gravity = pin.Motion(np.array([*gravity, 0.0, 0.0, 0.0]))
    parent = 0
    for i, body in enumerate(bodies):
        turning = pin.JointModelRUBZ() if body.continuous else pin.JointModelRZ()
        joint = pin.JointModelPZ() if body.prismatic else turning
        ends = (
            (np.full(2, -1.0), np.full(2, 1.0))
            if body.continuous
            else (limits.q_min[i : i + 1], limits.q_max[i : i + 1])
        )
        parent = model.addJoint(
            parent,
            joint,
            pin.SE3(body.placement),
            body.name,
            limits.tau_max[i : i + 1],
            limits.v_max[i : i + 1],
            *ends,
        )
        model.addJointFrame(parent)
        for pose, part in body.parts:
            inertia = pin.Inertia(part.mass, np.asarray(part.com, dtype=np.float64), part.inertia)
            model.appendBodyToJoint(parent, inertia, pin.SE3(pose))
    for frame, pose in frames:
        model.addFrame(pin.Frame(frame, parent, pin.SE3(pose), pin.FrameType.OP_FRAME))
    return model


def dh_model(
    table: Any,
    convention: str,
    name: str,
    joints: Sequence[str] | None,
    prismatic: Sequence[int],
    inertials: Sequence[Inertial | None] | None,
    base: Any,
    tool: Any,
    gravity: Any,
) -> Any:
    """A pinocchio model of the arm of a table of Denavit-Hartenberg parameters, see ``Robot.from_dh``."""
    rows = _rows(table)
    count = len(rows)
    names = [f"j{i + 1}" for i in range(count)] if joints is None else [str(joint) for joint in joints]
    if len(names) != count or len(set(names)) != count:
        raise InputError(
            f"joints has {len(set(names))} different names, expected {count}, one a row of the table"
        )
    masses = [None] * count if inertials is None else list(inertials)
    if len(masses) != count:
        raise InputError(f"inertials has {len(masses)} entries, expected {count}, one a row of the table")
    slides = {int(i) for i in prismatic}
    if not slides <= set(range(count)):
        raise InputError(f"prismatic is {sorted(slides)}, expected 0-based indices below {count}")
    if convention not in ("standard", "modified"):
        raise unknown("convention", convention, "DH tables", ["standard", "modified"])

    before = np.eye(4) if base is None else checked_pose(base, "base")
    bodies = []
    for i, (theta, d, a, alpha) in enumerate(rows):
        turn, lift = transform(rotation_z(theta), np.zeros(3)), placement((0.0, 0.0, d))
        arm, twist = placement((a, 0.0, 0.0)), transform(rotation_x(alpha), np.zeros(3))
        if convention == "standard":
            place, behind = (before @ turn, lift @ arm @ twist)
        else:
            place, behind = (before @ twist @ arm @ lift @ turn, np.eye(4))
        mass = masses[i]
        parts = () if mass is None else ((behind, mass),)
        bodies.append(Body(name=names[i], placement=place, prismatic=i in slides, parts=parts))
        before = behind
    end = before if tool is None else before @ checked_pose(tool, "tool")
    weight = array("gravity", gravity, (3,), "(3,)")
    return serial_model(name, bodies, JointLimits.of(count), frames=[(TIP, end)], gravity=tuple(weight))


def _rows(table: Any) -> FloatArray:
    count = len(table) if isinstance(table, (list, tuple, np.ndarray)) else 0
    if count == 0:
        raise InputError(f"table is {table!r:.80}, expected rows (theta, d, a, alpha)")
    return array("table", table, (count, 4), "(n, 4), rows (theta, d, a, alpha)")
