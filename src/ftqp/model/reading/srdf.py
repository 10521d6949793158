"""Reading SRDF, the file beside a URDF that names postures."""

from math import isfinite
from pathlib import Path
from xml.etree.ElementTree import Element

from ftqp.core.errors import FtqpError
from ftqp.model.reading.safe_xml import xml_of


def postures_beside(urdf: Path) -> dict[str, dict[str, float]]:
    """The postures (``group_state``) of the SRDF of a URDF, positions by joint [rad or m].

    It is looked for as ``NAME.srdf`` in the folder of ``NAME.urdf`` and in the folder ``srdf`` beside that. A
    file that cannot be read names none, for nothing but a start depends on it.

    Args:
        urdf: The path of the URDF.
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
