"""An MJCF file as MuJoCo's own compiler reads it; the one file that imports MuJoCo, which is optional."""

from logging import getLogger
from math import isnan
from typing import Any
from warnings import catch_warnings

import numpy as np

from ftqp.core.errors import InputError, MissingPackage
from ftqp.core.extras import remedy_for_extra
from ftqp.core.safe_path import safe_path
from ftqp.model.capsules import Collision
from ftqp.model.reading.safe_xml import xml_of

__all__ = ["compiled", "is_off", "mjcf_collisions", "mujoco"]

try:
    with safe_path():  # its glfw starts a Python when it is imported
        import mujoco
except ImportError as error:
    what = "MuJoCo, which reads MJCF and simulates arms,"
    raise MissingPackage(what, "mujoco", remedy_for_extra("sim")) from error
if mujoco.get_mju_user_warning() is None:  # else MuJoCo writes MUJOCO_LOG.TXT where the user works
    mujoco.set_mju_user_warning(getLogger("ftqp").warning)
GEOM = mujoco.mjtGeom


def compiled(source: Any, whole: bool = True) -> tuple[Any, str]:
    """The compiled model of a file or text, and what it is called."""
    text, root, path = xml_of(source, "MJCF", "mujoco")
    label = "the MJCF text" if path is None else f"MJCF {str(path)!r}"
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
    """Whether a flag such as ``GRAVITY`` is off; before MuJoCo 3.3.7 springs and dampers have one."""
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


def mjcf_collisions(source: Any) -> list[Collision]:
    """The geoms that collide, each named, with its pose in the world."""
    model, _ = compiled(source)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return [
        _piece(model, data, at)
        for at in range(model.ngeom)
        if model.geom_contype[at] or model.geom_conaffinity[at]
    ]


def _piece(model: Any, data: Any, at: int) -> Collision:
    name = model.geom(at).name or model.body(model.geom_bodyid[at]).name
    place = np.eye(4)
    place[:3, :3], place[:3, 3] = data.geom_xmat[at].reshape(3, 3), data.geom_xpos[at]
    x, y, z = model.geom_size[at].tolist()
    corners, size = None, tuple[float, ...]()
    match model.geom_type[at]:
        case GEOM.mjGEOM_PLANE:
            kind, size = "half_space", (0.0,)
        case GEOM.mjGEOM_SPHERE:
            kind, size = "sphere", (x,)
        case GEOM.mjGEOM_CAPSULE:
            kind, size = "capsule", (x, 2.0 * y)
        case GEOM.mjGEOM_CYLINDER:
            kind, size = "cylinder", (x, 2.0 * y)
        case GEOM.mjGEOM_BOX | GEOM.mjGEOM_ELLIPSOID:  # the box around it
            kind, size = "box", (2.0 * x, 2.0 * y, 2.0 * z)
        case GEOM.mjGEOM_MESH:
            kind, size = "mesh", (1.0, 1.0, 1.0)
            mesh = model.mesh(model.geom_dataid[at])
            first, count = int(mesh.vertadr[0]), int(mesh.vertnum[0])
            corners = np.array(model.mesh_vert[first : first + count], dtype=np.float64)
        case other:
            word = GEOM(other).name.removeprefix("mjGEOM_").lower()
            raise InputError(
                f"geom {name!r} of the MJCF is a {word}, expected a plane, "
                "sphere, capsule, ellipsoid, cylinder, box or mesh; put boxes in its place"
            )
    return Collision(link=name, kind=kind, size=size, place=place, corners=corners)
