"""A robot as URDF: one link behind each joint, the joint along its own z axis, a cylinder to look at.

A joint's frame is that of ``Chain``, so that poses, M and h of what is read back are the same to rounding.
URDF has no word for infinity (the largest float stands for it, as in pinocchio), none for gravity, and none
for rotors: those are written as Drake's extensions, which ``Robot.from_urdf`` and Drake read and every other
tool skips. Limits of acceleration, deceleration and jerk are words of URDF 1.2; that of acceleration is
written as Drake has it, too. The file names no version, for readers of 1.0 refuse a later one.
"""

from collections.abc import Sequence
from typing import Any
from unicodedata import category
from xml.etree.ElementTree import Comment, Element, SubElement, indent, tostring

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.core.pose import rotation_to
from ftqp.model.chain import Chain, ends_of
from ftqp.model.limits import JointLimits
from ftqp.model.reading.urdf import SYMMETRIC
from ftqp.model.shape import reach_of

BASE = "base"
"""The link that stands still."""
LARGEST = float(np.finfo(np.float64).max)
"""What stands for no limit."""
ENDLESS = (-np.inf, np.inf)
THIN, THICK = 0.015, 0.022
"""Radii of a link's and of a joint's cylinder, as shares of the reach."""
SHORT = 1e-6
"""A link shorter than this share of the reach is not drawn."""
DRAKE = "http://drake.mit.edu"


def urdf_text(name: str, model: Any, tips: Sequence[str], chain: Chain, limits: JointLimits) -> str:
    """The URDF of a robot, see ``Robot.to_urdf``."""
    joints = chain.names
    for one in (name, *tips, *joints):
        _refuse_unprintable(one)
    root = Element("robot", {"name": name, "xmlns:drake": DRAKE})
    root.append(Comment(_remark(chain)))
    links, ends = link_names(joints, tips), ends_of(model, tips)
    size = reach_of(chain, limits)
    behind = [*zip(chain.parent.tolist(), chain.translation, strict=True)]
    behind += [(body, at) for body, _, at in ends]
    base = SubElement(root, "link", name=links[0])
    _bars(base, behind, -1, size)
    for i, joint in enumerate(joints):
        _write_link(root, chain, i, links[i + 1], size)
        _bars(root[-1], behind, i, size)
        _write_joint(root, chain, limits, i, (links[chain.parent[i] + 1], joint, links[i + 1]))
    taken = list(joints)
    for tip, link, (body, rotation, at) in zip(tips, links[len(joints) + 1 :], ends, strict=True):
        SubElement(root, "link", name=link)
        taken.append(_free(f"{tip}_mount", taken))
        end = SubElement(root, "joint", name=taken[-1], type="fixed")
        SubElement(end, "parent", link=links[body + 1])
        SubElement(end, "child", link=link)
        _place(end, at, rotation)
    for joint, inertia in zip(joints, chain.armature, strict=True):
        if inertia:
            _write_rotor(root, joint, float(inertia))
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"


def link_names(joints: Sequence[str], tips: Sequence[str]) -> tuple[str, ...]:
    """Names of the links: ``base``, one behind each joint, and one a tip with the tip's own name."""
    taken = [BASE]
    for joint in joints:
        taken.append(_free(f"{joint}_link", taken))
    for tip in tips:
        taken.append(_free(tip, [*taken, *joints]))
    return tuple(taken)


def _free(name: str, taken: Sequence[str]) -> str:
    """``name``, made longer until nothing else has it."""
    while name in taken:
        name += "_"
    return name


def _refuse_unprintable(name: str) -> None:
    """XML holds neither control characters nor halves of characters, and a link needs a name."""
    if not name or any(category(letter) in ("Cc", "Cs") or letter in "\ufffe\uffff" for letter in name):
        raise InputError(
            f"the name {name!r:.80} cannot stand in a URDF, expected printable letters; rename it"
        )


def _remark(chain: Chain) -> str:
    """What the file does not hold, for who reads it."""
    gravity = " ".join(_number(value) for value in chain.gravity)
    return (
        f" Written by ftqp from its chain of joints: SI units and radians. {LARGEST!r} stands for no limit. "
        "Acceleration limits are acceleration and deceleration (URDF 1.2) and drake:acceleration, jerk "
        "limits jerk, rotor inertias (seen at the joint) drake:rotor_inertia; other tools skip them. "
        f"Gravity, which is no part of URDF: {gravity} m/s2. "
    )


def _write_link(root: Element, chain: Chain, i: int, name: str, size: float) -> None:
    """The body behind joint i, its mass and what is drawn of it."""
    link = SubElement(root, "link", name=name)
    mass, inertia = float(chain.mass[i]), chain.inertia[i]
    if mass or inertia.any():
        body = SubElement(link, "inertial")
        _place(body, chain.com[i], np.eye(3))
        SubElement(body, "mass", value=_number(mass))
        moments = inertia[np.triu_indices(3)]
        SubElement(
            body, "inertia", {key: _number(value) for key, value in zip(SYMMETRIC, moments, strict=True)}
        )
    _cylinder(link, np.zeros(3), np.eye(3), THICK * size, 2.0 * THICK * size)


def _bars(link: Element, behind: Sequence[tuple[int, FloatArray]], body: int, size: float) -> None:
    """Cylinders from the origin of a body to everything that hangs on it."""
    for parent, at in behind:
        if parent == body:
            _bar(link, at, size)


def _bar(link: Element, to: FloatArray, size: float) -> None:
    """A cylinder from the link's origin to the next one's."""
    length = float(np.linalg.norm(to))
    if length > SHORT * size:
        # Half a turn more, and no negative zeros: that writes rounder angles.
        turned = rotation_to(to / length) * (-1.0, -1.0, 1.0) + 0.0
        _cylinder(link, 0.5 * to, turned, THIN * size, length)


def _cylinder(link: Element, at: FloatArray, rotation: FloatArray, radius: float, length: float) -> None:
    visual = SubElement(link, "visual")
    _place(visual, at, rotation)
    shape = SubElement(visual, "geometry")
    SubElement(shape, "cylinder", radius=f"{radius:.6g}", length=f"{length:.6g}")


def _write_joint(
    root: Element, chain: Chain, limits: JointLimits, i: int, names: tuple[str, str, str]
) -> None:
    """Joint i, named between its two links, with its place, limits and friction."""
    parent, name, child = names
    low, high = float(limits.q_min[i]), float(limits.q_max[i])
    kind = "prismatic" if chain.prismatic[i] else "continuous" if (low, high) == ENDLESS else "revolute"
    joint = SubElement(root, "joint", name=name, type=kind)
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    _place(joint, chain.translation[i], chain.rotation[i])
    SubElement(joint, "axis", xyz="0 0 1")
    ends = {} if kind == "continuous" else {"lower": _number(low), "upper": _number(high)}
    rates = {"acceleration": limits.a_max[i], "deceleration": limits.a_max[i], "jerk": limits.j_max[i]}
    SubElement(
        joint,
        "limit",
        ends
        | {"velocity": _number(limits.v_max[i]), "effort": _number(limits.tau_max[i])}
        | {key: _number(rate) for key, rate in rates.items() if np.isfinite(rate)}
        | {"drake:acceleration": _number(limits.a_max[i])},
    )
    if chain.lead[i] != i:
        how = {"multiplier": _number(chain.ratio[i]), "offset": _number(chain.offset[i])}
        SubElement(joint, "mimic", {"joint": chain.names[chain.lead[i]], **how})
    if chain.viscous[i] or chain.coulomb[i]:
        rub = {"damping": _number(chain.viscous[i]), "friction": _number(chain.coulomb[i])}
        SubElement(joint, "dynamics", rub)


def _write_rotor(root: Element, joint: str, inertia: float) -> None:
    """The rotor of a joint, in the words of ROS and Drake."""
    transmission = SubElement(root, "transmission", name=f"{joint}_transmission")
    SubElement(transmission, "type").text = "transmission_interface/SimpleTransmission"
    SubElement(transmission, "joint", name=joint)
    actuator = SubElement(transmission, "actuator", name=f"{joint}_actuator")
    SubElement(actuator, "mechanicalReduction").text = "1"
    SubElement(actuator, "drake:gear_ratio", value="1")
    SubElement(actuator, "drake:rotor_inertia", value=_number(inertia))


def _place(element: Element, at: FloatArray, rotation: FloatArray) -> None:
    """The ``origin`` of an element."""
    words = (" ".join(_number(value) for value in part) for part in (at, pin.rpy.matrixToRpy(rotation)))
    SubElement(element, "origin", dict(zip(("xyz", "rpy"), words, strict=True)))


def _number(value: float) -> str:
    """All digits; the largest float for infinity."""
    return repr(float(np.clip(value, -LARGEST, LARGEST)) + 0.0)
