"""A pinocchio model of a serial arm, built from a list of bodies or a table of DH parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray, array, positive
from ftqp.core.errors import InputError, unknown
from ftqp.core.pose import pose as checked_pose
from ftqp.core.pose import rotation_x, rotation_z, transform
from ftqp.model.audit import Finding
from ftqp.model.chain import FREE_BASE
from ftqp.model.limits import JointLimits
from ftqp.model.shape import PLANAR_BASE

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


MARK = "\x1f"
"""Separates a frame's number from its name while a model is put together."""
ROOM = 10.0
"""How far a base goes in x and y, to either side, where nobody says so [m]."""


def graft(
    model: Any,
    parent: int,
    place: FloatArray,
    other: Any,
    names: Mapping[str, str] | None = None,
    order: Sequence[int] = (),
) -> None:
    """Adds the joints, bodies and frames of another pinocchio model behind a joint, 0 is the base."""
    base, number, at = pin.SE3(np.asarray(place)), {0: parent}, {0: _joint_frame(model, parent)}
    before, named, order = model.nv, names or {}, order or range(1, other.njoints)
    if other.inertias[0].mass:
        model.appendBodyToJoint(parent, other.inertias[0], base)
    for i in order:
        above, joint = other.parents[i], other.joints[i]
        where = other.jointPlacements[i] if above else base * other.jointPlacements[i]
        number[i] = model.addJoint(number[above], joint, where, named.get(other.names[i], other.names[i]))
        model.appendBodyToJoint(number[i], other.inertias[i], pin.SE3.Identity())
        at[i] = model.addJointFrame(number[i], at[above])
    for i, f in enumerate(other.frames):
        if f.type != pin.FrameType.JOINT and i > 0:
            joint = number[f.parentJoint]
            where = f.placement if f.parentJoint else base * f.placement
            name = named.get(f.name, f.name)  # pinocchio refuses two frames of one name
            new = model.addFrame(
                pin.Frame(f"{i}{MARK}{name}", joint, at[f.parentJoint], where, f.type), False
            )
            model.frames[new].name = name
    of = [other.idx_vs[i] + k for i in order for k in range(other.nvs[i])]
    for name in ("armature", "damping", "friction"):
        getattr(model, name)[before:] = getattr(other, name)[of]


def _joint_frame(model: Any, joint: int) -> int:
    """pinocchio's number of the frame of a joint; the first of all is that of the base."""
    if joint == 0:
        return 0
    return next(
        i for i, f in enumerate(model.frames) if f.parentJoint == joint and f.type == pin.FrameType.JOINT
    )


def planar_base(arm: Any, inertial: Inertial | None) -> Any:
    """A model with the joints ``PLANAR_BASE`` before those of an arm: x and y slide, yaw has no end."""
    joints = (pin.JointModelPX(), pin.JointModelPY(), pin.JointModelRUBZ())
    return _on_base(arm, dict(zip(PLANAR_BASE, joints, strict=True)), inertial)


def free_base(arm: Any, inertial: Inertial) -> Any:
    """A model with the joints ``FREE_BASE`` before those of an arm, without gravity."""
    slides = (pin.JointModelPX(), pin.JointModelPY(), pin.JointModelPZ())
    turns = (pin.JointModelRZ(), pin.JointModelRY(), pin.JointModelRX())
    model = _on_base(arm, dict(zip(FREE_BASE, (*slides, *turns), strict=True)), inertial)
    model.gravity = pin.Motion.Zero()
    return model


def _on_base(arm: Any, joints: Mapping[str, Any], inertial: Inertial | None) -> Any:
    """A model with some joints, and the mass of what they carry, before those of an arm."""
    for name in joints:
        if name in list(arm.names):
            raise InputError(f"{arm.name} has a joint {name!r} already; expected an arm on no base")
    model, parent = pin.Model(), 0
    model.name, model.gravity = arm.name, arm.gravity
    for name, joint in joints.items():
        parent = model.addJoint(parent, joint, pin.SE3.Identity(), name)
        model.addJointFrame(parent)
    if inertial is not None:
        com = np.array(inertial.com, dtype=np.float64)
        body = pin.Inertia(inertial.mass, com, np.array(inertial.inertia))
        model.appendBodyToJoint(parent, body, pin.SE3.Identity())
    graft(model, parent, np.eye(4), arm)
    return model


def is_about_base(finding: Finding) -> bool:
    """Whether a finding is that a joint of a planar base carries no mass of its own, which none needs."""
    return any(
        finding.sentence.endswith(f"joint {name!r} has no mass") for name in (*PLANAR_BASE, *FREE_BASE)
    )


def base_limits(v_max: Any, a_max: Any, q_range: Any, tau_max: Any) -> JointLimits:
    """The limits of x, y and yaw; yaw has no end."""
    if q_range is None or isinstance(q_range, (int, float)):
        far = ROOM if q_range is None else positive("q_range", q_range, "m")
        q_range = [[-far, far], [-far, far]]
    room = array("q_range", q_range, (2, 2), "one number, or lowest and highest of x and of y")
    ends = np.vstack([room, [-np.inf, np.inf]])
    return JointLimits.of(3, q_min=ends[:, 0], q_max=ends[:, 1], v_max=v_max, a_max=a_max, tau_max=tau_max)


FAR, FAST, TILT = 1e3, 1e2, 1.4
"""Limits of a base that floats, which nothing moves and nothing holds: places [m] and turns [rad], rates, and
how far it pitches from where its yaw and roll are one [rad]."""


def free_base_limits() -> JointLimits:
    """The limits of a base that floats: wide, but for its pitch."""
    ends = np.full(6, FAR)
    ends[4] = TILT
    return JointLimits.of(6, q_min=-ends, q_max=ends, v_max=FAST, a_max=FAR, tau_max=np.inf)
