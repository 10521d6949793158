"""Reading SRDF, the file beside a URDF that names postures, and pairs of links that may touch."""

from math import isfinite
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

from ftqp.core.errors import FtqpError, InputError
from ftqp.model.reading.safe_xml import xml_of


def postures_beside(urdf: Path) -> dict[str, dict[str, float]]:
    """The postures (``group_state``) of the SRDF of a URDF, positions by joint [rad or m].

    It is looked for as ``NAME.srdf`` in the folder of ``NAME.urdf`` and in the folder ``srdf`` beside that. A
    file that cannot be read names none, for nothing but a start depends on it.
    """
    name = f"{urdf.stem}.srdf"
    for file in (urdf.parent / name, urdf.parent.parent / "srdf" / name):
        if file.is_file():
            try:
                _, root, _ = xml_of(file, "SRDF", "robot")
            except FtqpError:
                return {}
            states = root.findall("group_state")
            return {state.get("name", ""): _positions(state.findall("joint")) for state in states}
    return {}


def allowed_pairs(source: Any) -> list[tuple[str, str]]:
    """The pairs of links that an SRDF does not look at (``disable_collisions``)."""
    _, root, _ = xml_of(source, "SRDF", "robot")
    pairs = [(one.get("link1", ""), one.get("link2", "")) for one in root.iter("disable_collisions")]
    for pair in pairs:
        if not all(pair):
            raise InputError(f"a disable_collisions of the SRDF has {pair}, expected link1 and link2")
    return pairs


def _positions(joints: list[Element]) -> dict[str, float]:
    found: dict[str, float] = {}
    for joint in joints:
        try:
            value = float(joint.get("value", ""))
        except ValueError:
            continue
        if isfinite(value):
            found[joint.get("name", "")] = value
    return found
