"""The table ``[robot]``."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot
from typing import Any

import numpy as np

from ftqp.app.schema.reading import Options, Table
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.core.pose import transform
from ftqp.core.setting import setting
from ftqp.model.capsules import Capsule
from ftqp.model.payload import Payload

PerJoint = tuple[float, ...] | None
"""One number for all joints, or one each."""
Limit = tuple[float, ...] | dict[str, float] | None
"""That, or those of some joints by name."""
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
"""x, y, z, w."""
EACH: Mapping[str, Any] = {"infinite": True, "one_for_all": True}
"""What a setting says that is one number for all joints, or one each, of which infinity is none."""


def quaternion_rotation(quaternion: Quaternion) -> FloatArray:
    """R, (3, 3), of a unit quaternion x, y, z, w."""
    length = hypot(*quaternion)
    if abs(length - 1.0) > 1e-3:
        raise InputError(f"orientation has the length {length:.4g}, expected a unit quaternion x, y, z, w")
    from scipy.spatial.transform import Rotation  # slow to load, needed with an orientation only

    return np.asarray(Rotation.from_quat(quaternion).as_matrix())


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitsTable(Table):
    """Limits that replace those of the model: one number for all, one each, or some by name; inf is none."""

    q_min: Limit = setting(
        None, "least positions, as one number, a list, or { joint = number }", unit="rad or m", **EACH
    )
    q_max: Limit = setting(None, "greatest positions, the same", unit="rad or m", **EACH)
    v_max: Limit = setting(None, "speed limits, the same, > 0", unit="rad/s or m/s", **EACH)
    a_max: Limit = setting(None, "acceleration limits, the same, > 0", unit="rad/s2 or m/s2", **EACH)
    tau_max: Limit = setting(None, "torque limits, the same, > 0", unit="N m or N", **EACH)
    j_max: Limit = setting(
        None, "jerk limits of motions to a posture, the same, > 0", unit="rad/s3 or m/s3", **EACH
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolTable(Table):
    """Another controlled point, in the frame of the tip; it weighs nothing."""

    position: Vector = setting((0.0, 0.0, 0.0), "of the point in the tip frame", unit="m")
    orientation: Quaternion = setting(
        (0.0, 0.0, 0.0, 1.0), "quaternion x, y, z, w of its axes in the tip frame"
    )

    @property
    def pose(self) -> FloatArray:
        """The pose of the point in the tip frame, (4, 4) [m]."""
        return transform(quaternion_rotation(self.orientation), np.array(self.position))


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotTable(Table):
    """The arm: exactly one of ``name``, ``urdf``, ``mjcf`` and ``dh``."""

    name: str | None = setting(None, "a robot of the catalog, see `ftqp robots`")
    options: dict[str, Any] | None = setting(
        None, "of a robot of the catalog, for example { lengths = [1, 1, 1], continuous = true }"
    )
    urdf: str | None = setting(None, "a URDF file", file=True)
    mjcf: str | None = setting(None, "an MJCF file", file=True)
    dh: tuple[tuple[float, ...], ...] | None = setting(
        None, "a table of rows theta [rad], d [m], a [m], alpha [rad]", count=(1, None)
    )
    convention: str | None = setting(
        None,
        "convention of dh, 'standard' or 'modified'; standard if absent",
        choices=("standard", "modified"),
    )
    tip: str | None = setting(None, "the frame that carries out the task; needed with urdf and mjcf")
    tips: tuple[str, ...] | None = setting(
        None, "in place of tip, several frames whose joints stay; the first carries out the path's task"
    )
    locked: tuple[str, ...] | None = setting(
        None, "joints held at their neutral position, for example fingers"
    )
    acceleration: PerJoint = setting(
        None,
        "acceleration limits in place of the model's, > 0; MJCF and most URDFs have none",
        unit="rad/s2 or m/s2",
        **EACH,
    )
    limits: LimitsTable | None = setting(None, "limits that replace those of the model")
    payload: Options[Payload] | None = setting(None, "a load that the arm carries and knows of")
    tool: ToolTable | None = setting(None, "a point on the tool to control in place of the end effector")
    viscous: PerJoint = setting(
        None, "viscous friction in place of the model's, >= 0", unit="N m s/rad or N s/m", **EACH
    )
    coulomb: PerJoint = setting(
        None, "Coulomb friction in place of the model's, >= 0", unit="N m or N", **EACH
    )
    rotors: PerJoint = setting(
        None, "inertia of the rotors at the joints in place of the model's, >= 0", unit="kg m2 or kg", **EACH
    )
    capsules: tuple[Options[Capsule], ...] | None = setting(
        None, "bodies of the arm for distances, in place of those of its links", count=(1, None)
    )

    def __post_init__(self) -> None:
        given = [key for key in ("name", "urdf", "mjcf", "dh") if getattr(self, key) is not None]
        if len(given) != 1:
            got = f"has {' and '.join(given)}" if given else "names no robot"
            raise InputError(f"{got}, expected exactly one of name, urdf, mjcf, dh")
