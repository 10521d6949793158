"""The arm that a checker knows: a URDF, its links and limits, read by pinocchio and by itself."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Self, final
from xml.etree import ElementTree

import coal
import numpy as np
import pinocchio as pin

from ftqp.core.checks import BoolArray, FloatArray
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


DRAKE = "{http://drake.mit.edu}"
LARGEST = float(np.finfo(np.float64).max)
"""Stands for no limit in a file."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModelFile:
    """Kinematics, dynamics and limits of a serial arm, as its model file has them.

    Configurations q, velocities v and accelerations a are (K, nv) [rad or m, and a second, and a second
    squared], or (nv,) where one is asked for. Points and frames that move with a joint, by its 0-based
    index, are given as they are in the base frame while all joints are at 0.
    """

    model: Any  # The pinocchio model; every joint has one velocity
    tip: int  # Index of the tip's frame
    names: tuple[str, ...]  # Joint names, base to tip
    q_min: FloatArray  # Lowest positions, (nv,) [rad or m]
    q_max: FloatArray  # Highest positions, (nv,) [rad or m]
    v_max: FloatArray  # Largest speeds, (nv,) [rad/s or m/s]
    a_max: FloatArray  # Largest accelerations, (nv,) [rad/s2 or m/s2]; infinite where the file has none
    tau_max: FloatArray  # Largest torques, (nv,) [N m or N]
    friction: FloatArray  # Viscous friction, (nv,) [N m s/rad or N s/m]
    dry_friction: FloatArray  # Friction of which only the size is known, (nv,) [N m or N]
    has_masses: bool  # Whether the file has any
    links: tuple[LinkShape, ...] = ()  # Pieces of its links, where they are known

    @classmethod
    def read(cls, source: str | Path, tip: str, *, gravity: Any = (0.0, 0.0, -9.81)) -> Self:
        """The arm in a URDF."""
        text = source if isinstance(source, str) and "<" in source else Path(source).read_text("utf-8")
        try:
            root, model = ElementTree.fromstring(text), pin.buildModelFromXML(text)
        except (ElementTree.ParseError, ValueError, RuntimeError) as error:
            raise InputError(f"the model file is no URDF: {error!s:.200}") from error
        if model.nv != model.njoints - 1 or not model.existFrame(tip):
            raise InputError(f"the model file is not that of an arm of simple joints with the link {tip!r}")
        model.gravity.linear = np.array(gravity, dtype=np.float64)
        joints = {joint.get("name", ""): joint for joint in root.findall("joint")}
        names = tuple(str(name) for name in model.names)[1:]
        rows = np.array([_limits(joints[name]) for name in names])
        armature = {
            transmission.find("joint").get("name"): float(rotor.get("value", "0"))  # type: ignore[union-attr]
            for transmission in root.findall("transmission")
            if (rotor := transmission.find(f"actuator/{DRAKE}rotor_inertia")) is not None
        }
        model.armature = np.array([armature.get(name, 0.0) for name in names])
        return cls(
            model=model,
            tip=model.getFrameId(tip, pin.FrameType.BODY),
            names=names,
            q_min=rows[:, 0],
            q_max=rows[:, 1],
            v_max=rows[:, 2],
            a_max=rows[:, 3],
            tau_max=rows[:, 4],
            friction=rows[:, 5],
            dry_friction=rows[:, 6],
            has_masses=any(model.inertias[i].mass > 0.0 for i in range(1, model.njoints)),
        )

    def tips(self, q: FloatArray) -> FloatArray:
        """Poses of the tip, (K, 4, 4) [m]."""
        data = self.model.createData()
        result = np.empty((len(q), 4, 4))
        for k, at in enumerate(self._configurations(q)):
            pin.forwardKinematics(self.model, data, at)
            result[k] = pin.updateFramePlacement(self.model, data, self.tip).homogeneous
        return result

    def point(self, q: FloatArray, joint: int, at_zero: Sequence[float]) -> FloatArray:
        """Places of a point that moves with a joint, (K, 3) [m]."""
        T = np.eye(4)
        T[:3, 3] = at_zero
        return self.poses(q, joint, T)[:, :3, 3]

    def poses(self, q: FloatArray, joint: int, at_zero: FloatArray) -> FloatArray:
        """Poses of a frame that moves with a joint, (K, 4, 4) [m]; of the base where that is -1."""
        if joint < 0:
            return np.tile(at_zero, (len(q), 1, 1))
        data, (zero,) = self.model.createData(), self._configurations(np.zeros((1, q.shape[1])))
        pin.forwardKinematics(self.model, data, zero)
        own = data.oMi[joint + 1].actInv(pin.SE3(np.array(at_zero, dtype=np.float64)))
        result = np.empty((len(q), 4, 4))
        for k, at in enumerate(self._configurations(q)):
            pin.forwardKinematics(self.model, data, at)
            result[k] = (data.oMi[joint + 1] * own).homogeneous
        return result

    def centres(self, q: FloatArray) -> FloatArray:
        """Places of the centre of mass, (K, 3) [m]."""
        data = self.model.createData()
        return np.array([pin.centerOfMass(self.model, data, at).copy() for at in self._configurations(q)])

    def moves_with(self, joint: int) -> tuple[int, ...]:
        """The joints that move the link behind a joint, that one included, by 0-based index."""
        return tuple(int(one) - 1 for one in self.model.supports[joint + 1] if int(one) > 0)

    def tip_and_jacobian(self, data: Any, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The pose of the tip, (4, 4) [m], and its Jacobian along the base's axes, (6, nv)."""
        (at,) = self._configurations(q[None])
        J = pin.computeFrameJacobian(self.model, data, at, self.tip, pin.LOCAL_WORLD_ALIGNED)
        return pin.updateFramePlacement(self.model, data, self.tip).homogeneous, J

    def torques(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """What the joints carry, tau = M a + h with rotors and viscous friction, (K, nv) [N m or N]."""
        data = self.model.createData()
        moved = [
            pin.rnea(self.model, data, at, v[k], a[k]).copy() for k, at in enumerate(self._configurations(q))
        ]
        return np.reshape(moved, v.shape) + self.friction * v

    def dynamics(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """M, (nv, nv), and h, (nv,), with tau = M a + h; rotors and viscous friction are part of them."""
        data, (at,) = self.model.createData(), self._configurations(q[None])
        M = pin.crba(self.model, data, at)
        M = np.triu(M) + np.triu(M, 1).T
        h = pin.nonLinearEffects(self.model, data, at, v) + self.friction * v
        return M, h

    def _configurations(self, q: FloatArray) -> FloatArray:
        """pinocchio's configurations, in which a joint that turns without end has a cosine and a sine."""
        endless: BoolArray = np.array([self.model.nqs[i] == 2 for i in range(1, self.model.njoints)])
        if not endless.any():
            return q
        columns: list[FloatArray] = []
        for i in range(q.shape[1]):
            columns += [np.cos(q[:, i]), np.sin(q[:, i])] if endless[i] else [q[:, i]]
        return np.stack(columns, axis=1)


def _limits(joint: ElementTree.Element) -> list[float]:
    """q_min, q_max, v_max, a_max, tau_max, viscous and dry friction of a joint."""
    limit, rub = joint.find("limit"), joint.find("dynamics")
    written = {} if limit is None else dict(limit.attrib)
    endless = joint.get("type") == "continuous"
    found = [
        -np.inf if endless else float(written.get("lower", "-inf")),
        np.inf if endless else float(written.get("upper", "inf")),
        float(written.get("velocity", "inf")),
        float(written.get(f"{DRAKE}acceleration", "inf")),
        float(written.get("effort", "inf")),
    ]
    found = [value if abs(value) < LARGEST else float(np.copysign(np.inf, value)) for value in found]
    return [*found, *(0.0 if rub is None else float(rub.get(name, "0")) for name in ("damping", "friction"))]
