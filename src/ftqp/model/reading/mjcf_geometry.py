"""Geometry of an MJCF file that things collide with, where its joints begin."""

from typing import Any

import numpy as np

from ftqp.core.errors import InputError
from ftqp.model.capsules import Collision
from ftqp.model.reading.compiled_mjcf import compiled
from ftqp.model.reading.mujoco_package import mujoco

GEOM = mujoco.mjtGeom


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
