"""Reading MJCF, MuJoCo's model files."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from ftqp.core.errors import InputError, MissingPackage
from ftqp.model.audit import Finding, note, unsafe
from ftqp.model.chain import kind
from ftqp.model.followers import Follower
from ftqp.model.reading.mjcf_motors import motor_limits
from ftqp.model.reading.safe_xml import xml_of
from ftqp.model.reading.source import Source, source_of

PROBE = """<mujoco><worldbody><body name="b"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<joint name="j" type="slide" range="0 1"/></body></worldbody></mujoco>"""
"""One joint that slides from 0 m to 1 m; pinocchio 4.1 takes metres for degrees, as angles are by default."""

NUMBERS = {
    "axis": 3,
    "pos": 3,
    "range": 2,
    "actuatorfrcrange": 2,
    "armature": 1,
    "damping": 1,
    "frictionloss": 1,
}
"""Attributes of a joint that are finite numbers, and how many."""


def read(source: Any) -> Source:
    """An MJCF file or text as it was read.

    Raises:
        InputError: The file cannot be read, includes others, or pinocchio does not understand it.
    """
    text, root, path = xml_of(source, "MJCF", "mujoco")
    _refuse_parts(root, path)
    name = root.get("model") or "robot"
    model = _model(text, path)
    model.name = name
    findings = _audit(root)
    if (
        not findings
        and not any(one.mass for one in model.inertias)
        and next(root.iter("geom"), None) is not None
    ):
        findings += _weighed(model, text, path)
    compiler = root.find("compiler")
    if compiler is None or compiler.get("angle", "degree") == "degree":
        _restore_slides(model)
    moved = {joint.get("name") for joint in root.iter("joint") if "ref" in joint.attrib}
    followers = {
        joint.get("joint1", ""): _follower(joint, moved)
        for joint in root.iterfind("equality/joint")
        if joint.get("active", "true") == "true"
    }
    read_model = source_of(model)
    most, wrong = motor_limits(root)
    limits = {
        name: {**written, "tau_max": min(written["tau_max"], most.get(name, np.inf))}
        for name, written in read_model.limits.items()
    }
    return Source(
        model=model,
        limits=limits,
        followers=followers,
        findings=[*findings, *wrong],
        postures=read_model.postures,
    )


def _weighed(model: Any, text: str, path: Path | None) -> list[Finding]:
    """Takes the masses of geoms from MuJoCo; says so where it is missing."""
    try:
        from ftqp.model.reading.mjcf_masses import weigh  # MuJoCo is optional
    except MissingPackage as error:
        return [note(f"its masses may stand in its geoms, which MuJoCo reads: {error}")]
    weigh(model, text, path)
    return []


def _follower(joint: ElementTree.Element, moved: set[str | None]) -> Follower:
    """How a joint of an equality follows another one: y = a_0 + a_1 x, unless it is something else."""
    leader = joint.get("joint2")
    values = _numbers(joint.get("polycoef", "0 1 0 0 0")) or [0.0, np.nan]
    offset, ratio, *more = [*values, 0.0, 0.0][: max(len(values), 2)]
    why = ""
    if leader is None:
        why = "a constant moves no joint"
    elif any(more):
        why = f"along the curve {joint.get('polycoef')!r:.60}, not in proportion"
    elif leader in moved or joint.get("joint1") in moved:
        why = "one of them has a ref, by which angles are counted from elsewhere"
    return Follower(leader=leader or "a constant", ratio=ratio, offset=offset, otherwise=why)


def _refuse_parts(root: ElementTree.Element, path: Path | None) -> None:
    """Pinocchio would leave out what stands in other files, limits among it, without a word."""
    part = next(root.iter("include"), None)
    if part is None:
        return
    name = "MJCF" if path is None else f"MJCF {str(path)!r}"
    file = "FILE" if path is None else path.name
    raise InputError(
        f"{name} includes {part.get('file')!r:.80}, expected one file with the whole arm; name the file that "
        "has the arm itself, or let MuJoCo make one of all: "
        f"mujoco.mj_saveLastXML('whole.xml', mujoco.MjModel.from_xml_path({file!r}))"
    )


def _model(text: str, path: Path | None) -> Any:
    if path is None:
        with TemporaryDirectory() as folder:
            written = Path(folder, "robot.xml")
            written.write_text(text, encoding="utf-8")
            return _model(text, written)
    try:
        return pin.buildModelFromMJCF(str(path))
    except (ValueError, RuntimeError, IndexError) as error:
        reason = str(error).rpartition("message:")[2].strip()
        raise InputError(f"MJCF {str(path)!r} was refused by pinocchio: {reason:.300}") from error


def _audit(root: ElementTree.Element) -> list[Finding]:
    """Joints and masses whose figures pinocchio would read as something else without a word."""
    found: list[Finding] = []
    for joint in root.iter("joint"):
        label = f"joint {joint.get('name') or joint.get('class') or 'without a name'!r}"
        for key, count in NUMBERS.items():
            if key not in joint.attrib:
                continue
            values = _numbers(joint.attrib[key])
            expected = "a finite number" if count == 1 else f"{count} finite numbers"
            if values is None or len(values) != count:
                found.append(unsafe(f"{label} has {key} {joint.attrib[key]!r:.60}, expected {expected}"))
            elif key == "axis" and not any(values):
                found.append(unsafe(f"{label} has a zero axis, expected a direction"))
    for inertial in root.iter("inertial"):
        mass = _numbers(inertial.get("mass", ""))
        if mass is None or len(mass) != 1 or mass[0] < 0.0:
            found.append(unsafe(f"a body has a mass of {inertial.get('mass')!r:.60}, expected kg > 0"))
    return found


def _numbers(text: str) -> list[float] | None:
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        return None
    return values if np.isfinite(values).all() else None


def _restore_slides(model: Any) -> None:
    """Brings ranges of sliding joints back to metres where pinocchio took them for degrees."""
    probe = float(_model(PROBE, None).upperPositionLimit[0])
    for i in range(1, model.njoints):
        if kind(model.joints[i]).startswith("P") and model.nqs[i] == 1:
            at = model.idx_qs[i]
            model.lowerPositionLimit[at] /= probe
            model.upperPositionLimit[at] /= probe
