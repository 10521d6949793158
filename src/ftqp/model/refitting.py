"""What is changed on an arm without reading it anew: payload, tool and friction, in copies of its model."""

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.core.pose import pose as checked_pose
from ftqp.model.audit import LARGEST_FIGURE, Finding, note, unsafe, warning
from ftqp.model.chain import frame_id
from ftqp.model.limits import JointLimits
from ftqp.model.payload import Payload

REMEDY = "robot.with_friction(viscous=..., coulomb=...)"


def loaded(model: Any, tip: str, payload: Any) -> Any:
    """A copy of the model with a payload at the frame ``tip``."""
    if not isinstance(payload, Payload):
        raise InputError(f"payload is {payload!r:.60}, expected an ftqp.Payload, ftqp.Payload(mass=0.5)")
    if not has_masses(model):
        raise InputError(
            f"{model.name} has no masses, so a payload means nothing to it; give the model its masses"
        )
    copy = model.copy()
    frame = copy.frames[frame_id(copy, tip)]
    body = pin.Inertia(payload.mass, np.array(payload.com), np.array(payload.inertia))
    copy.appendBodyToJoint(frame.parentJoint, body, frame.placement)
    return copy


def with_tip(model: Any, tip: str, place: Any, name: str) -> Any:
    """A copy of the model with one more frame, ``name``, at the pose ``place`` in the frame ``tip``."""
    if any(frame.name == name for frame in model.frames):
        raise InputError(f"{name!r} is already a frame of {model.name}; give the new tip another name=")
    copy = model.copy()
    index = frame_id(copy, tip)
    frame = copy.frames[index]
    at = frame.placement * pin.SE3(checked_pose(place, "T"))
    copy.addFrame(pin.Frame(name, frame.parentJoint, index, at, pin.FrameType.OP_FRAME))
    return copy


def with_friction(model: Any, viscous: FloatArray, coulomb: FloatArray) -> Any:
    """A copy of the model with other friction."""
    copy = model.copy()
    write_friction(copy, viscous, coulomb)
    return copy


def with_rotors(model: Any, inertia: FloatArray) -> Any:
    """A copy of the model with other rotors."""
    copy = model.copy()
    copy.armature = np.array(inertia, dtype=np.float64)
    return copy


def write_friction(model: Any, viscous: Any, coulomb: Any) -> None:
    """Writes viscous and Coulomb friction into a pinocchio model of a chain; one number holds for all."""
    model.damping = np.broadcast_to(np.asarray(viscous, dtype=np.float64), (model.nv,)).copy()
    model.friction = np.broadcast_to(np.asarray(coulomb, dtype=np.float64), (model.nv,)).copy()


def has_masses(model: Any) -> bool:
    """Whether a body behind a joint has a mass or an inertia."""
    bodies = [model.inertias[i] for i in range(1, model.njoints)]
    return any(body.mass != 0.0 or np.any(body.inertia) for body in bodies)


def friction_findings(model: Any, limits: JointLimits) -> list[Finding]:
    """What there is to say about the friction of a model's joints, which is none without masses."""
    found: list[Finding] = []
    names = [str(name) for name in model.names][1:]
    viscous, coulomb = np.asarray(model.damping), np.asarray(model.friction)
    for what, values in (("viscous friction (damping)", viscous), ("Coulomb friction", coulomb)):
        for name, value in zip(names, values, strict=True):
            if not 0.0 <= value <= LARGEST_FIGURE:
                found.append(unsafe(f"joint {name!r} has a {what} of {value:g}, expected >= 0"))
    if found or not (viscous.any() or coulomb.any()):
        return [replace(finding, about="friction") for finding in found]
    sentence = (
        f"joint friction is known: viscous {_span(viscous)} N m s/rad, Coulomb {_span(coulomb)} N m; torques "
        f"count the viscous part; replace it with {REMEDY}"
    )
    found.append(note(sentence))
    for i, name in enumerate(names):
        needed = viscous[i] * limits.v_max[i] if viscous[i] else 0.0
        if np.isfinite(needed) and needed > limits.tau_max[i]:
            sentence = (
                f"joint {name!r} needs {needed:.3g} N m against its viscous friction at its speed limit, "
                f"beyond its torque limit of {limits.tau_max[i]:g} N m; correct one of them, {REMEDY}"
            )
            found.append(warning(sentence))
    return [replace(finding, about="friction") for finding in found]


def _span(values: FloatArray) -> str:
    low, high = f"{values.min():.3g}", f"{values.max():.3g}"
    return low if low == high else f"{low} to {high}"
