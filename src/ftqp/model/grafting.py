"""Robots put together of others: an arm carried by joints of a base, two arms on one body."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray, array, positive
from ftqp.core.errors import InputError
from ftqp.model.audit import Finding
from ftqp.model.chain import FREE_BASE
from ftqp.model.limits import JointLimits
from ftqp.model.serial import Inertial
from ftqp.model.shape import PLANAR_BASE

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
    """Adds the joints, bodies and frames of another pinocchio model behind a joint, 0 is the base.

    What stands still in the other model moves with that joint. Limits, which pinocchio refuses where they are
    NaN or crossed, are not copied. Joints and frames are called as before, or as ``names`` has them, and
    joints come in their order, or in that of ``order``, parents first.
    """
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
    for field in ("armature", "damping", "friction"):
        getattr(model, field)[before:] = getattr(other, field)[of]


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
