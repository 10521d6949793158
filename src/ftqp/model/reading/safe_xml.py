"""Reading robot files and meshes safely, what cannot be one is refused; and SRDF, the file beside a URDF."""

import re
from math import isfinite
from os import PathLike, fspath
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.parsers import expat

from ftqp.core.errors import FtqpError, InputError

DRAKE = "http://drake.mit.edu"
"""The namespace of Drake's extensions, which say what URDF has no word for."""
MESHES = (".stl", ".obj", ".ply", ".glb", ".dae")
"""How names of meshes end."""
KNOWN = {"xml": "http://www.w3.org/XML/1998/namespace", "drake": DRAKE}
"""Prefixes that mean something where a file does not declare them, too."""


READERS = {"robot": "from_urdf", "mujoco": "from_mjcf"}
"""Which method of a robot reads a file with this root element."""


def xml_of(source: Any, kind: str, root: str) -> tuple[str, ElementTree.Element, Path | None]:
    """The XML of a robot as ROS and pinocchio read it: undeclared prefixes, ``--`` in comments."""
    text, path = _text_of(source, kind)
    label = f"{kind} {str(path)!r}" if path else f"the {kind} text"
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError(f"{label} declares a document type or an entity, which no {kind} needs; remove it")
    try:
        tree = _tree_of(text)
    except (expat.ExpatError, ValueError) as error:
        raise InputError(f"{label} is not well-formed XML: {error}; correct it there") from error
    if tree.tag != root:
        reader = READERS.get(tree.tag)
        raise InputError(
            f"{label} has the root element <{tree.tag!s:.60}>, expected <{root}>"
            f"{f'; such a file is read by ftqp.Robot.{reader}' if reader else ''}"
        )
    for element in tree.iter():
        if _is_xacro(element):
            raise InputError(f"{label} is a xacro that was not expanded; run 'xacro FILE > robot.urdf' first")
    return text, tree, path


def _text_of(source: Any, kind: str) -> tuple[str, Path | None]:
    if isinstance(source, str) and source.lstrip("\ufeff \t\r\n").startswith("<"):
        return source.lstrip("\ufeff \t\r\n"), None
    if not isinstance(source, (str, PathLike)):
        raise InputError(f"a {kind} is given by its path or as XML text, got {type(source).__name__}")
    path = Path(fspath(source))
    name = f"{kind} {str(path)!r:.300}"
    try:
        if path.is_dir():
            raise InputError(f"{name} is a folder, expected a file")
        if not path.is_file():
            raise InputError(f"{name} does not exist; expected a file or XML text")
        return path.read_text(encoding="utf-8-sig").lstrip(), path
    except UnicodeDecodeError as error:
        raise InputError(f"{name} is not text in UTF-8 (byte {error.start})") from error
    except OSError as error:
        raise InputError(f"{name} cannot be read: {error!s:.200}") from error


_SKIPPED = re.compile(r"<!\[CDATA\[.*?\]\]>|<!--.*?-->|<\?xml\s.*?\?>", re.DOTALL)
"""Comments and the declaration, beside them texts in which neither is one."""


def _blank(found: re.Match[str]) -> str:
    """A comment or declaration as empty lines, so that messages name the lines of the file."""
    text = found.group()
    return text if text.startswith("<![") else "\n" * text.count("\n")


def _tree_of(text: str) -> ElementTree.Element:
    """The root; names with a declared prefix are ``{namespace}name``, a default namespace is left out."""
    builder, parser = ElementTree.TreeBuilder(), expat.ParserCreate()
    parser.buffer_text = True
    scopes = [KNOWN]

    def named(name: str) -> str:
        prefix, colon, local = name.partition(":")
        space = scopes[-1].get(prefix) if colon else None
        return name if space is None else f"{{{space}}}{local}"

    def start(tag: str, attributes: dict[str, str]) -> None:
        new = {key[6:]: value for key, value in attributes.items() if key.startswith("xmlns:")}
        scopes.append({**scopes[-1], **new} if new else scopes[-1])
        kept = {named(key): value for key, value in attributes.items() if not key.startswith("xmlns")}
        builder.start(named(tag), kept)

    def end(tag: str) -> None:
        builder.end(named(tag))
        scopes.pop()

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = builder.data
    parser.Parse(_SKIPPED.sub(_blank, text).encode(), True)
    return builder.close()


def _is_xacro(element: ElementTree.Element) -> bool:
    tag = str(element.tag)
    in_namespace = tag.startswith("xacro:") or (tag.startswith("{") and "xacro" in tag.partition("}")[0])
    return in_namespace or any("${" in value or value.startswith("$(") for value in element.attrib.values())


def refuse_other_than_mesh(file: Path) -> None:
    """Refuse a file that no reader of meshes is to see."""
    if file.suffix.lower() not in MESHES:
        kinds = ", ".join(end[1:].upper() for end in MESHES)
        raise InputError(
            f"mesh {str(file)!r:.200} is packed, or is no mesh (it ends in {file.suffix!r:.20}, expected one "
            f"of {kinds}); convert it to STL"
        )


def postures_beside(urdf: Path) -> dict[str, dict[str, float]]:
    """The postures [rad or m] of ``NAME.srdf`` beside a URDF or in ``../srdf``; none if unreadable."""
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


def _positions(joints: list[ElementTree.Element]) -> dict[str, float]:
    found: dict[str, float] = {}
    for joint in joints:
        try:
            value = float(joint.get("value", ""))
        except ValueError:
            continue
        if isfinite(value):
            found[joint.get("name", "")] = value
    return found
