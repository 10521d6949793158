"""Reading URDF: the tree is audited first, then pinocchio gets a cleaned copy without meshes."""

import logging
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, ModelError
from ftqp.model.audit import Finding, body_findings, note, unsafe, warning
from ftqp.model.capsules import Collision
from ftqp.model.followers import Follower
from ftqp.model.reading.safe_xml import DRAKE, postures_beside, xml_of
from ftqp.model.reading.source import Source, unlimited

_LOG = logging.getLogger("ftqp")

KINDS = ("revolute", "prismatic", "continuous", "fixed", "floating", "planar")
"""Joint types of URDF."""

MOVING = ("revolute", "prismatic", "continuous")

RATES = ("acceleration", "deceleration", f"{{{DRAKE}}}acceleration")
"""Attributes of a limit that bound the acceleration: those of URDF 1.2, and Drake's."""

GEOMETRY = {
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "box": ("size",),
    "mesh": ("scale",),
}
"""What a link is made of for collisions, and the attributes that are its sizes; capsules are of URDF 1.2."""

SIZES = {"sphere": 1, "cylinder": 2, "capsule": 2, "box": 3, "mesh": 3}
"""How many numbers these attributes hold."""

SYMMETRIC = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


@dataclass(slots=True)
class Tree:
    """What the audit needs of a URDF, and what it found so far."""

    name: str
    links: dict[str, Element]
    joints: dict[str, Element]
    findings: list[Finding] = field(default_factory=list)

    def chain(self, tip: str) -> list[str]:
        """Joints from the base to a link or joint, base first."""
        above = {_attribute(joint, "child", "link"): name for name, joint in self.joints.items()}
        at = tip if tip in self.links else _attribute(self.joints[tip], "child", "link")
        result: list[str] = []
        while at in above and above[at] not in result:
            result.append(above[at])
            at = _attribute(self.joints[above[at]], "parent", "link")
        return result[::-1]


def read(source: Any, tips: Sequence[str], locked: Sequence[str | int]) -> Source:
    """A URDF as it was read."""
    _, root, path = xml_of(source, "URDF", "robot")
    tree = _tree(root)
    is_tree = not tree.findings
    known = is_tree and tips and all(tip in tree.links or tip in tree.joints for tip in tips)
    moving = {name for tip in tips for name in tree.chain(tip)} if known else set(tree.joints)
    _audit_joints(tree, moving, locked)
    _audit_links(tree)
    if not is_tree:
        raise ModelError(f"{tree.name} is unsafe", [finding.sentence for finding in tree.findings])
    try:
        model = pin.buildModelFromXML(tostring(_cleaned(tree), encoding="unicode"))
    except (ValueError, RuntimeError) as error:
        raise InputError(f"{tree.name} was refused by pinocchio: {str(error).strip()!s:.300}") from error
    model.name = tree.name
    _write_rotors(model, root, tree)
    return Source(
        model=model,
        limits={name: _limits(joint) for name, joint in tree.joints.items()},
        followers={
            name: Follower(
                leader=_attribute(joint, "mimic", "joint"),
                ratio=_number(_attribute(joint, "mimic", "multiplier") or "1"),
                offset=_number(_attribute(joint, "mimic", "offset") or "0"),
            )
            for name, joint in tree.joints.items()
            if joint.find("mimic") is not None
        },
        findings=tree.findings,
        postures={} if path is None else postures_beside(path),
        shapes=shapes_of(tree.links, path),
    )


def shapes_of(
    links: Mapping[str, Element], path: Path | None, tag: str = "collision", *, mirrored: bool = False
) -> list[Collision]:
    """The geometry of links as it is written, that collides or is seen (``visual``)."""
    found = []
    for name, link in links.items():
        for element in link.findall(tag):
            geometry = element.find("geometry")
            shape = None if geometry is None else next(iter(geometry), None)
            if shape is None or shape.tag not in GEOMETRY:
                continue
            size = [x for key in GEOMETRY[shape.tag] for x in map(_number, shape.get(key, "").split())]
            if shape.tag == "mesh" and "scale" not in shape.attrib:
                size = [1.0, 1.0, 1.0]
            if len(size) != SIZES[shape.tag] or not np.isfinite(size).all():
                _LOG.warning(
                    "the %s of link %r has the sizes %s, expected %d finite numbers; it is left out",
                    shape.tag, name, size, SIZES[shape.tag],
                )  # fmt: skip
                continue
            origin = _origin(element)
            least = min(map(abs, size) if mirrored and shape.tag == "mesh" else size, default=0.0)
            if not (least > 0.0 and np.isfinite(origin).all()):
                continue
            place = pin.SE3(pin.rpy.rpyToMatrix(*origin[3:]), origin[:3]).homogeneous
            found.append(
                Collision(
                    link=name, kind=shape.tag, size=tuple(size), place=place,
                    file=shape.get("filename", ""), beside=None if path is None else Path(path),
                )
            )  # fmt: skip
    return found


def _attribute(element: Element, tag: str, name: str) -> str:
    child = element.find(tag)
    return "" if child is None else child.get(name, "")


def _tree(root: Element) -> Tree:
    """Links and joints by name, with findings where they do not make one tree."""
    tree = Tree(root.get("name") or "robot", {}, {})
    wrong: list[str] = []
    for group, tag in ((tree.links, "link"), (tree.joints, "joint")):
        for element in root.findall(tag):
            name = element.get("name", "")
            if not name or name in group:
                wrong.append(f"a {tag} has {'no name' if not name else f'the name {name!r} again'}")
            group[name] = element
    children: dict[str, str] = {}
    for name, joint in tree.joints.items():
        if (kind := joint.get("type")) not in KINDS:
            wrong.append(f"joint {name!r} has the type {kind!r}, expected one of {', '.join(KINDS)}")
        for end in ("parent", "child"):
            link = _attribute(joint, end, "link")
            if link not in tree.links:
                wrong.append(f"joint {name!r} has the {end} link {link!r}, which does not exist")
        child = _attribute(joint, "child", "link")
        if child in children:
            both = f"{children[child]!r} and {name!r}"
            wrong.append(f"link {child!r} is the child of both {both}; expected a tree")
        children[child] = name
    roots = [link for link in tree.links if link not in children]
    if not tree.links:
        wrong.append("there are no links, expected a base and moving links")
    elif not wrong and len(roots) != 1:
        wrong.append(f"there are {len(roots)} links without a parent {roots!r:.200}, expected one base")
    tree.findings += map(unsafe, wrong)
    return tree


def _audit_joints(tree: Tree, moving: Container[str], locked: Sequence[str | int]) -> None:
    """Origins of all joints, and axes, friction and limits of those in ``moving`` that will move."""
    for name, joint in tree.joints.items():
        wrong = []
        if not np.isfinite(_origin(joint)).all():
            wrong.append("an origin that is not finite numbers")
        if name in moving and name not in locked and joint.get("type") in MOVING:
            if joint.find("limit") is not None:
                tree.findings += [*_range_findings(name, joint), *_rate_findings(name, joint)]
            axis = _axis(joint)
            if not np.isfinite(_friction(joint)).all():
                wrong.append("damping or friction that is no finite number")
            if not np.isfinite(axis).all():
                wrong.append("an axis that is not three finite numbers")
            elif not axis.any():
                wrong.append("a zero axis, expected a direction")
        tree.findings += [unsafe(f"joint {name!r} has {what}") for what in wrong]


def _range_findings(name: str, joint: Element) -> Iterator[Finding]:
    """A range of which one side is missing, and so 0."""
    limit = joint.find("limit")
    assert limit is not None
    missing = [key for key in ("lower", "upper") if key not in limit.attrib]
    low, high = _range(limit)
    if joint.get("type") != "continuous" and len(missing) == 1 and low < high:
        yield warning(
            f"joint {name!r} has no {missing[0]} limit, which means 0 in a URDF: its range is {low:g} to "
            f"{high:g}; correct the file, or give limits={{'q_min': {{{name!r}: ...}}, "
            f"'q_max': {{{name!r}: ...}}}}",
            "q_min" if missing == ["lower"] else "q_max",
        )


def _range(limit: Element) -> tuple[float, float]:
    """The range as written; a side that is missing is 0 where that leaves a range, else NaN as both are."""
    low, high = (_number(limit.get(key, "0")) for key in ("lower", "upper"))
    absent = [key not in limit.attrib for key in ("lower", "upper")]
    if all(absent) or (any(absent) and low >= high):
        return (np.nan if absent[0] else low), (np.nan if absent[1] else high)
    return low, high


def _rate_findings(name: str, joint: Element) -> Iterator[Finding]:
    """Limits of acceleration, deceleration and jerk that are none, or that differ where a joint has one."""
    limit = joint.find("limit")
    assert limit is not None
    for key in (*RATES, "jerk"):
        text = limit.get(key)
        if text is not None and not _number(text) > 0.0:
            about = "j_max" if key == "jerk" else "a_max"
            yield unsafe(
                f"joint {name!r} has the limit {_plain(key)}={text!r:.60}, expected a number > 0; "
                f"correct the file or give limits={{...}} with {about}",
                about,
            )
    rates = {_plain(key): unlimited(_number(limit.get(key, ""))) for key in RATES if key in limit.attrib}
    least = min(rates.values(), default=np.nan)
    if all(rate > 0.0 for rate in rates.values()) and any(rate != least for rate in rates.values()):
        said = ", ".join(f"{key} {rate:g}" for key, rate in rates.items())
        yield note(
            f"joint {name!r} has limits of {said}; a joint speeds up and brakes with one a_max, so the "
            f"smallest, {least:g}, is taken",
            "a_max",
        )


def _plain(key: str) -> str:
    return key.replace(f"{{{DRAKE}}}", "drake:")


def _axis(joint: Element) -> FloatArray:
    return _numbers(_attribute(joint, "axis", "xyz") or "1 0 0", 3)


def _friction(joint: Element) -> FloatArray:
    """Viscous [N m s/rad or N s/m] and Coulomb friction [N m or N], (2,); 0 where none is written."""
    return np.array([_number(_attribute(joint, "dynamics", key) or "0") for key in ("damping", "friction")])


def _origin(element: Element) -> FloatArray:
    """xyz [m] and roll, pitch, yaw [rad], (6,)."""
    parts = [_numbers(_attribute(element, "origin", key) or "0 0 0", 3) for key in ("xyz", "rpy")]
    return np.concatenate(parts)


def _audit_links(tree: Tree) -> None:
    """Masses and inertias of every link, as they are written."""
    names, bodies = [], []
    for name, link in tree.links.items():
        inertial = link.find("inertial")
        if inertial is None:
            continue
        if written := _unreadable(inertial):
            said = f"link {name!r} has a mass, centre of mass or inertia that is not finite: {written}"
            sentence = f"{said}, expected numbers such as 0.5; correct the model"
            tree.findings.append(unsafe(sentence, "masses"))
        elif (body := _inertial(inertial))[0] != 0.0 or body[2].any():
            names.append(name)
            bodies.append(body)
    tree.findings += body_findings("link", names, *map(np.array, zip(*bodies, strict=True))) if names else []


def _unreadable(inertial: Element) -> str | None:
    """The first attribute of a link's masses that is not finite numbers, as it is written."""
    for tag, keys in (("mass", ("value",)), ("inertia", SYMMETRIC), ("origin", ("xyz", "rpy"))):
        for key in keys:
            text = _attribute(inertial, tag, key)
            if not np.isfinite([*map(_number, text.split())]).all():
                return f"<{tag} {key}={text!r:.80}>"
    return None


def _inertial(element: Element) -> tuple[float, FloatArray, FloatArray]:
    mass = _number(_attribute(element, "mass", "value"))
    xx, xy, xz, yy, yz, zz = (_number(_attribute(element, "inertia", key) or "0") for key in SYMMETRIC)
    return mass, _origin(element), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _write_rotors(model: Any, root: Element, tree: Tree) -> None:
    """Rotor inertias at the joints, as Drake has them: ``rotor_inertia`` times ``gear_ratio`` squared."""
    for transmission in root.findall("transmission"):
        name = _attribute(transmission, "joint", "name")
        actuator = transmission.find("actuator")
        if actuator is None or name not in tree.joints or tree.joints[name].get("type") not in MOVING:
            continue
        inertia = _number(_attribute(actuator, f"{{{DRAKE}}}rotor_inertia", "value") or "0")
        ratio = _number(_attribute(actuator, f"{{{DRAKE}}}gear_ratio", "value") or "1")
        model.armature[model.idx_vs[model.getJointId(name)]] = inertia * ratio**2


def _limits(joint: Element) -> dict[str, float]:
    """Limits of a joint as written, NaN where missing; a_max (the smallest) and j_max where they are."""
    if joint.get("type") == "continuous":
        low, high, default = -np.inf, np.inf, np.inf
    else:
        low = high = default = np.nan
    limit = joint.find("limit")
    if limit is None:
        return {"q_min": low, "q_max": high, "v_max": default, "tau_max": default}
    if joint.get("type") != "continuous":
        low, high = _range(limit)
    speed, effort = (_number(limit.get(key, str(default))) for key in ("velocity", "effort"))
    found = {"q_min": low, "q_max": high, "v_max": speed, "tau_max": effort}
    rates = [_number(limit.get(key, "")) for key in RATES if key in limit.attrib]
    if rates:
        found["a_max"] = min(rates)
    if (jerk := limit.get("jerk")) is not None:
        found["j_max"] = _number(jerk)
    return {key: unlimited(value) for key, value in (found | _soft_limits(joint)).items()}


def _soft_limits(joint: Element) -> dict[str, float]:
    """The ends at which ROS controllers stop, where written; both 0, or crossed, are none."""
    written = {
        key: _number(_attribute(joint, "safety_controller", name))
        for key, name in (("soft_min", "soft_lower_limit"), ("soft_max", "soft_upper_limit"))
    }
    found = {key: value for key, value in written.items() if np.isfinite(value)}
    return {} if len(found) == 2 and found["soft_min"] >= found["soft_max"] else found


def _cleaned(tree: Tree) -> Element:
    """A URDF with nothing but what pinocchio needs; what is wrong stands in it as something harmless."""
    root = Element("robot", name=tree.name)
    for name, link in tree.links.items():
        copy = SubElement(root, "link", name=name)
        inertial = link.find("inertial")
        if inertial is not None:
            mass, origin, inertia = _inertial(inertial)
            if np.isfinite(mass) and np.isfinite(origin).all() and np.isfinite(inertia).all():
                body = SubElement(copy, "inertial")
                _write_origin(body, origin)
                SubElement(body, "mass", value=repr(mass))
                values = inertia[np.triu_indices(3)]
                moments = {key: repr(float(v)) for key, v in zip(SYMMETRIC, values, strict=True)}
                SubElement(body, "inertia", moments)
    for name, joint in tree.joints.items():
        copy = SubElement(root, "joint", name=name, type=joint.get("type", ""))
        for end in ("parent", "child"):
            SubElement(copy, end, link=_attribute(joint, end, "link"))
        _write_origin(copy, np.nan_to_num(_origin(joint), posinf=0.0, neginf=0.0))
        axis = _axis(joint)
        sound = np.isfinite(axis).all() and axis.any()
        SubElement(copy, "axis", xyz=_words(axis if sound else np.array([1.0, 0.0, 0.0])))
        SubElement(copy, "limit", lower="-1", upper="1", velocity="1", effort="1")
        rub = np.nan_to_num(_friction(joint), posinf=0.0, neginf=0.0)
        SubElement(copy, "dynamics", damping=repr(float(rub[0])), friction=repr(float(rub[1])))
    return root


def _write_origin(element: Element, origin: FloatArray) -> None:
    SubElement(element, "origin", xyz=_words(origin[:3]), rpy=_words(origin[3:]))


def _words(values: FloatArray) -> str:
    return " ".join(repr(float(value)) for value in values)


def _number(text: str) -> float:
    """A number of the file, NaN where it is none, as is 1_000, which Python would take."""
    try:
        return float(text) if text.isascii() and "_" not in text else float("nan")
    except ValueError:
        return float("nan")


def _numbers(text: str, count: int) -> FloatArray:
    values = [*map(_number, text.split())]
    return np.array(values) if len(values) == count else np.full(count, np.nan)
