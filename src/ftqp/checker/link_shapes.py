"""Links as the model file has them: collision geometry of a URDF, meshes by their hulls, for coal."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import coal
import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError


class LinkShape(NamedTuple):
    """A piece of a link."""

    name: str  # Of the piece
    joint: int  # 0-based index of the joint that it moves with; -1 of none
    at_zero: FloatArray  # Its pose while all joints are at 0, in the base frame, (4, 4) [m]
    shape: Any  # As coal has it
    reach: float  # How far it extends from its own origin [m]


def link_shapes(file: Path, joints: Sequence[str]) -> tuple[LinkShape, ...]:
    """The links of a URDF that have collision geometry; joints that are not named stay where they begin."""
    folders = [str(folder) for folder in (file.parent, *file.parent.parents)]
    try:
        model = pin.buildModelFromUrdf(str(file))
        geometry = pin.buildGeomFromUrdf(model, str(file), pin.GeometryType.COLLISION, package_dirs=folders)
    except (ValueError, RuntimeError) as error:
        raise InputError(f"the links of {file} cannot be read: {error!s:.200}") from error
    data = model.createData()
    pin.forwardKinematics(model, data, pin.neutral(model))
    found = []
    for piece in geometry.geometryObjects:
        joint = _moving(model, int(piece.parentJoint), joints)
        T = (data.oMi[piece.parentJoint] * piece.placement).homogeneous
        shape = piece.geometry
        if isinstance(shape, coal.BVHModelBase):
            shape = hull_of_corners(np.array(shape.vertices()))
        shape.computeLocalAABB()
        reach = float(shape.aabb_radius + np.linalg.norm(shape.aabb_center))
        found.append(LinkShape(str(piece.name), joint, T, shape, reach))
    return tuple(found)


def hull_of_corners(points: FloatArray) -> Any:
    """The convex hull of some points as coal has it."""
    corners = coal.StdVec_Vec3s()
    for point in np.asarray(points, dtype=np.float64):
        corners.append(point)
    return coal.Convex.convexHull(corners, True, "Qt")


def _moving(model: Any, at: int, joints: Sequence[str]) -> int:
    """The next joint below ``at`` that moves, by its place in ``joints``; -1 where there is none."""
    while at > 0 and model.names[at] not in joints:
        at = int(model.parents[at])
    return joints.index(model.names[at]) if at > 0 else -1
