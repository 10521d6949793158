"""Torque limits that an MJCF file states at its actuators, which pinocchio does not read."""

from collections.abc import Mapping
from xml.etree import ElementTree

import numpy as np

from ftqp.model.audit import Finding, unsafe

KINDS = ("general", "motor", "position", "velocity", "intvelocity", "damper", "cylinder", "muscle")
"""Elements of ``<actuator>``; a default class has one set of attributes for all of them."""
ALIKE = "main"
"""The class of what names none."""


def motor_limits(root: ElementTree.Element) -> tuple[dict[str, float], list[Finding]]:
    """The most that the actuators of each joint give together [N m or N], and what is wrong with them.

    The range of an actuator's force counts, and that of its control where the force is in proportion to it,
    as a ``motor``'s is; both times its gear. A joint that one of its actuators leaves without a limit has
    none.

    Args:
        root: ``<mujoco>``.
    """
    classes = _classes(root)
    compiler = root.find("compiler")
    auto = compiler is None or compiler.get("autolimits", "true") == "true"
    most: dict[str, float] = {}
    findings: list[Finding] = []
    for one in root.iterfind("actuator/*"):
        if one.tag not in KINDS:
            continue
        given = {**classes.get(one.get("class", ALIKE), {}), **one.attrib}
        joint = given.get("joint") or given.get("jointinparent")
        if joint is None:
            continue
        label = f"the actuator {one.get('name') or joint!r:.60}"
        gear = _first(given.get("gear", "1"), "gear", label, findings)
        bounds = [np.inf]
        if _limits(given, "force", auto):
            bounds.append(_least(given["forcerange"], "forcerange", label, findings))
        if _limits(given, "ctrl", auto) and _is_proportional(one.tag, given):
            gain = given.get("gainprm", "1") if one.tag == "general" else "1"
            force = abs(_first(gain, "gainprm", label, findings))
            bounds.append(force * _least(given["ctrlrange"], "ctrlrange", label, findings))
        most[joint] = most.get(joint, 0.0) + (abs(gear) * min(bounds) if gear else 0.0)
    return most, findings


def _classes(root: ElementTree.Element) -> dict[str, dict[str, str]]:
    """What actuators of each default class have, with what the class is nested in."""
    found: dict[str, dict[str, str]] = {}

    def look(element: ElementTree.Element, inherited: Mapping[str, str], name: str) -> None:
        own = dict(inherited)
        for kind in KINDS:
            for one in element.iterfind(kind):
                own.update(one.attrib)
        found[name] = own
        for inner in element.iterfind("default"):
            look(inner, own, inner.get("class", ""))

    for outer in root.iterfind("default"):
        look(outer, {}, ALIKE)
        found.setdefault(outer.get("class", ALIKE), found[ALIKE])
    return found


def _limits(given: Mapping[str, str], what: str, auto: bool) -> bool:
    """Whether an actuator's range of force or control counts."""
    said = given.get(f"{what}limited", "auto")
    return f"{what}range" in given and (said == "true" or (said == "auto" and auto))


def _is_proportional(kind: str, given: Mapping[str, str]) -> bool:
    """Whether an actuator's force is its control times a number."""
    if kind == "general":
        usual = (("gaintype", "fixed"), ("biastype", "none"), ("dyntype", "none"))
        return all(given.get(name, value) == value for name, value in usual)
    return kind == "motor"


def _least(text: str, key: str, label: str, findings: list[Finding]) -> float:
    """What a range allows either way."""
    try:
        low, high = (float(word) for word in text.split())
    except ValueError:
        low, high = np.nan, np.nan
    if not low < high:
        findings.append(unsafe(f"{label} has {key} {text!r:.60}, expected two numbers, the lesser one first"))
        return np.inf
    return min(abs(low), abs(high)) or max(abs(low), abs(high))


def _first(text: str, key: str, label: str, findings: list[Finding]) -> float:
    """The first of some numbers."""
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    if not values or not np.isfinite(values).all():
        findings.append(unsafe(f"{label} has {key} {text!r:.60}, expected finite numbers"))
        return 1.0
    return values[0]
