"""An MJCF file as MuJoCo's own compiler reads it, which is what a simulator works with."""

from collections.abc import Iterator
from contextlib import suppress
from math import isnan, prod
from pathlib import Path
from typing import Any
from warnings import catch_warnings
from xml.etree import ElementTree

import numpy as np

from ftqp.core.errors import InputError
from ftqp.model.reading.mujoco_package import mujoco
from ftqp.model.reading.safe_xml import LARGEST, xml_of

COPIES = ("replicate", "composite", "flexcomp")
"""Elements that stand for ``count`` of what they hold."""
MOST_PARTS = 100_000
"""A file that makes more parts than this fills the memory; scenes with hundreds of robots have fewer."""
COUNTS = {"hfield": ("nrow", "ncol"), "texture": ("width", "height")}
"""Sizes of what has a number for each of its places."""
MOST_PLACES = 2**26
"""The same for those: a picture of 8,192 times 8,192."""


def compiled(source: Any, whole: bool = True) -> tuple[Any, str]:
    """The compiled model of a file or text, and what it is called."""
    text, root, path = xml_of(source, "MJCF", "mujoco")
    label = "the MJCF text" if path is None else f"MJCF {str(path)!r}"
    _refuse_bombs(root, path, label)
    try:
        spec = mujoco.MjSpec.from_string(text) if path is None else mujoco.MjSpec.from_file(str(path))
        if not whole:
            _keep_masses(spec)
            _name_frames(spec)
        with catch_warnings(action="ignore"):  # what is out of date is read as it is meant
            model = spec.compile()
    except (ValueError, RuntimeError, MemoryError, mujoco.FatalError, mujoco.UnexpectedError) as error:
        reason = " ".join(str(error).split()).removeprefix("Error: ").removeprefix("XML Error: ")
        view = "FILE" if path is None else path.name
        remedy = f"correct it until 'python -m mujoco.viewer --mjcf={view}' shows it"
        if "opening file" in reason or "resource" in reason:
            remedy = "put that file where the MJCF looks for it"
            if "include" not in reason:
                remedy += (
                    ", or give the bodies that it belongs to an <inertial>, with which no mesh is needed"
                )
        raise InputError(f"{label} was refused by MuJoCo: {reason:.300}; {remedy}") from error
    for name in ("body_pos", "body_quat", "body_mass", "body_ipos", "body_inertia", "jnt_pos", "jnt_axis",
                 "qpos0", "key_qpos", "site_pos"):  # fmt: skip
        if not np.isfinite(getattr(model, name)).all():
            raise InputError(f"{label} has numbers among {name} that are not finite; correct the file")
    return model, root.get("model") or "robot"


def is_off(model: Any, what: str) -> bool:
    """Whether a flag of the file switches something off, for example ``GRAVITY``.

    Older ones than MuJoCo 3.3.7 have one flag for springs and dampers.
    """
    bits = mujoco.mjtDisableBit
    bit = getattr(bits, f"mjDSBL_{what}", None) or bits.mjDSBL_PASSIVE
    return bool(model.opt.disableflags & int(bit))


def _keep_masses(spec: Any) -> None:
    """Leaves out the geometry that no mass comes from, with its files."""
    forced = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    for geom in spec.geoms:
        body = geom.parent
        rules = getattr(body, "compiler", spec.compiler)  # its own from MuJoCo 3.4 on
        low, high = rules.inertiagrouprange
        weighs = not (body.explicitinertial and rules.inertiafromgeom != forced) and low <= geom.group <= high
        weightless = geom.mass == 0.0 or (isnan(geom.mass) and geom.density == 0.0)
        if body.name != "world" and weighs and not weightless:
            continue
        if (geom.meshname or geom.hfieldname) and geom.type != mujoco.mjtGeom.mjGEOM_SDF:
            geom.type, geom.size = mujoco.mjtGeom.mjGEOM_SPHERE, (1.0, 0.0, 0.0)
            geom.meshname = geom.hfieldname = ""
    needed = {getattr(one, "meshname", "") for one in (*spec.geoms, *spec.sites)}
    needed |= {geom.hfieldname for geom in spec.geoms}
    unneeded = [one for one in (*spec.meshes, *spec.hfields, *spec.skins) if one.name not in needed]
    for one in (*spec.sensors, *unneeded):  # sensors first, for they may name meshes
        spec.delete(one)
    for texture in spec.textures:
        texture.file, texture.builtin = "", mujoco.mjtBuiltin.mjBUILTIN_FLAT
        texture.width = texture.height = 1
        for side in range(len(texture.cubefiles)):
            texture.cubefiles[side] = ""
    spec.compiler.fusestatic = False  # its bodies may be tips


def _name_frames(spec: Any) -> None:
    """A site where a named ``frame`` stands: compiled, frames are no more."""
    taken = {one.name for one in (*spec.sites, *spec.bodies)}
    for frame in spec.frames:
        if frame.name and frame.name not in taken:
            frame.parent.add_site(name=frame.name).set_frame(frame)


def _refuse_bombs(root: ElementTree.Element, path: Path | None, label: str) -> None:
    """A few lines may stand for billions of parts, which MuJoCo's compiler would begin to make."""
    parts = 0.0
    for element, copies in _parts(root, path):
        parts += copies
        size = element.tag == "size" and max(
            (_product(text) for key, text in element.items() if key == "nkey" or key.startswith("nuser")),
            default=0.0,
        )
        places = prod(_product(element.get(key, "1")) for key in COUNTS.get(element.tag, ()))
        if parts > MOST_PARTS or size > MOST_PARTS or places > MOST_PLACES:
            raise InputError(
                f"{label} stands for more than {MOST_PARTS:,} parts or {MOST_PLACES:,} points with its "
                f"<{element.tag!s:.60}>, which no robot has; take those out that the arm does not need"
            )


def _parts(root: ElementTree.Element, path: Path | None) -> Iterator[tuple[ElementTree.Element, float]]:
    """Every element, those of included files among them, and how many of it a file stands for."""
    left, read = [(root, 1.0)], set[Path]()
    while left:
        element, copies = left.pop()
        if element.tag in COPIES:
            copies *= _product(element.get("count", "1"))
        yield element, copies
        left += [(inner, copies) for inner in element]
        file = element.get("file")
        if path is not None and element.tag in ("include", "model") and file:
            other = path.parent / file
            if other not in read and other.is_file() and other.stat().st_size <= LARGEST:
                read.add(other)
                with suppress(ElementTree.ParseError):  # MuJoCo says what is wrong with it
                    left.append((ElementTree.fromstring(other.read_bytes()), copies))


def _product(text: str) -> float:
    """The numbers of an attribute multiplied, 1 where there are none."""
    try:
        return abs(prod(float(word) for word in text.split()))
    except ValueError:
        return 1.0
