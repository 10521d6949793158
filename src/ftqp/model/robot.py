"""A robot: chain, limits and tip of one arm, immutable and audited."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self, final

import numpy as np
import pinocchio as pin

from ftqp.core.checks import BoolArray, FloatArray, array, frozen
from ftqp.model import audit
from ftqp.model.audit import Finding
from ftqp.model.build import ROWS, Wishes, robot_fields, write_limits
from ftqp.model.chain import Chain, frame_id
from ftqp.model.limits import JointLimits
from ftqp.model.reading import dh, mjcf, urdf
from ftqp.model.reading.source import source_of
from ftqp.model.reduction import joint_index
from ftqp.model.serial import Inertial
from ftqp.model.shape import neutral_of


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Robot:
    """An arm between its base and one tip; made by ``from_urdf``, ``from_mjcf``, ``from_dh`` and the like.

    Attributes:
        name: of the robot.
        model: pinocchio model in which every joint off the chain is held.
        tip: name of the controlled frame.
        chain: all that the kernel knows of the robot.
        limits: of the joints.
        neutral: a sensible configuration inside the limits, (nv,) [rad or m].
        default_rows: task rows the robot is meant for, of x, y, z, rx, ry, rz.
        length: characteristic length [m], by default a sixth of the reach.
        findings: what the audit had to say; an unsafe robot is refused.
    """

    name: str
    model: Any
    tip: str
    chain: Chain
    limits: JointLimits
    neutral: FloatArray
    default_rows: tuple[str, ...]
    length: float
    findings: tuple[Finding, ...]

    def __repr__(self) -> str:
        """Name, joints and tip."""
        return f"Robot({self.name!r}, joints={list(self.joints)}, tip={self.tip!r})"

    @property
    def nq(self) -> int:
        """Size of pinocchio's configuration; a continuous joint takes two numbers of it."""
        return int(self.model.nq)

    @property
    def nv(self) -> int:
        """Number of joints."""
        return len(self.chain.names)

    @property
    def joints(self) -> tuple[str, ...]:
        """Joint names, base to tip."""
        return self.chain.names

    @property
    def continuous(self) -> BoolArray:
        """Joints that turn without limits, (nv,)."""
        return self.chain.continuous

    @property
    def has_inertia(self) -> bool:
        """Whether masses are known, so that torques can be limited and minimised."""
        return bool(self.chain.mass.any() or self.chain.inertia.any())

    def joint(self, name_or_index: str | int) -> int:
        """The 0-based index of a joint.

        Raises:
            InputError: no such joint; names the valid ones and the nearest.
        """
        return joint_index(self.joints, name_or_index, self.name)

    def angles(self, q: Any) -> FloatArray:
        """Joint positions (nv,) from (nv,) positions or from pinocchio's configuration (nq,) [rad or m].

        Raises:
            InputError: another shape, NaN or infinite.
        """
        if self.nq == self.nv or np.shape(q) == (self.nv,):
            return array("q", q, (self.nv,), "(nv,)")
        configuration = array("q", q, (self.nq,), "(nv,) or (nq,)")
        result = np.empty(self.nv)
        for i, at in enumerate(self.model.idx_qs[1:]):
            if self.continuous[i]:
                result[i] = np.arctan2(configuration[at + 1], configuration[at])
            else:
                result[i] = configuration[at]
        return result

    def configuration(self, q: Any) -> FloatArray:
        """pinocchio's configuration (nq,) from (nv,) positions or (nq,) itself [rad or m].

        Raises:
            InputError: another shape, NaN or infinite.
        """
        positions = self.angles(q)
        result = np.empty(self.nq)
        for i, at in enumerate(self.model.idx_qs[1:]):
            if self.continuous[i]:
                result[at : at + 2] = np.cos(positions[i]), np.sin(positions[i])
            else:
                result[at] = positions[i]
        return result

    def pose(self, q: Any) -> FloatArray:
        """Pose T_WE of the tip, (4, 4) [m].

        Args:
            q: configuration, (nv,) or (nq,) [rad or m].
        """
        data = self.model.createData()
        pin.forwardKinematics(self.model, data, self.configuration(q))
        pin.updateFramePlacements(self.model, data)
        return np.array(data.oMf[frame_id(self.model, self.tip)].homogeneous)

    def with_limits(
        self,
        *,
        q_min: Any = None,
        q_max: Any = None,
        v_max: Any = None,
        a_max: Any = None,
        tau_max: Any = None,
    ) -> Self:
        """This robot with some limits replaced, each (nv,) or one number for all; None keeps what there is.

        Raises:
            InputError: a wrong shape.
            ModelError: limits that are unsafe.
        """
        given = {"q_min": q_min, "q_max": q_max, "v_max": v_max, "a_max": a_max, "tau_max": tau_max}
        limits = self.limits.replaced({name: value for name, value in given.items() if value is not None})
        found = [f for f in self.findings if f.about != "limits"]
        found += audit.limit_findings(self.joints, limits, self.continuous)
        audit.refuse_unsafe(self.name, found)
        model = self.model.copy()
        write_limits(model, limits)
        start = frozen(neutral_of(limits, self.neutral))
        return replace(self, limits=limits, model=model, neutral=start, findings=tuple(found))

    @classmethod
    def from_pinocchio(
        cls,
        model: Any,
        tip: str | None = None,
        locked: Sequence[str | int] = (),
        *,
        q_locked: Mapping[str, float] | None = None,
        limits: JointLimits | Mapping[str, Any] | None = None,
        acceleration: Any = None,
        name: str | None = None,
        neutral: Any = None,
        default_rows: Sequence[str] = ROWS,
        length: float | None = None,
        gravity: Any = None,
        kinematics_only: bool = False,
    ) -> Self:
        """A robot from a pinocchio model, which is copied.

        Args:
            model: a pinocchio model.
            tip: name of the controlled frame; None: the only end of the model.
            locked: joints to hold, by name or 0-based index; joints off the chain are held anyway.
            q_locked: positions of held joints by name [rad or m]; neutral without an entry.
            limits: replaces the model's limits, all or some (``{"v_max": 1.0}``), each (nv,) or one number.
            acceleration: a_max, (nv,) or one number [rad/s2 or m/s2]; None: ``v_max / RISE_TIME``.
            name: of the robot; None: the model's.
            neutral: a configuration inside the limits, (nv,); None: zero, or the middle of the range.
            default_rows: task rows the robot is meant for.
            length: characteristic length [m]; None: a sixth of the reach.
            gravity: in the base frame, (3,) [m/s2]; None: the model's.
            kinematics_only: no masses, no rotor inertias; torques are then neither limited nor minimised.

        Raises:
            InputError: an unknown tip or joint, or a wrong shape.
            ModelError: the robot is unsafe or not a chain; carries every finding.
        """
        wishes = Wishes(
            tip=tip,
            locked=locked,
            q_locked=q_locked,
            limits=limits,
            acceleration=acceleration,
            name=name,
            neutral=neutral,
            default_rows=default_rows,
            length=length,
            gravity=gravity,
            kinematics_only=kinematics_only,
        )
        return cls(**robot_fields(source_of(model), wishes))

    @classmethod
    def from_urdf(
        cls,
        source: Any,
        tip: str | None = None,
        locked: Sequence[str | int] = (),
        *,
        q_locked: Mapping[str, float] | None = None,
        limits: JointLimits | Mapping[str, Any] | None = None,
        acceleration: Any = None,
        name: str | None = None,
        neutral: Any = None,
        default_rows: Sequence[str] = ROWS,
        length: float | None = None,
        gravity: Any = None,
        kinematics_only: bool = False,
    ) -> Self:
        """A robot from a URDF: the path of a file or the XML itself; meshes are not loaded.

        The arguments are those of ``from_pinocchio``. A URDF has no acceleration limit: give
        ``acceleration``, or ``v_max / RISE_TIME`` is taken, and a finding says so.

        Raises:
            InputError: the file cannot be read, an unknown tip or joint, or a wrong shape.
            ModelError: the robot is unsafe or not a chain; carries every finding.
        """
        wishes = Wishes(
            tip=tip,
            locked=locked,
            q_locked=q_locked,
            limits=limits,
            acceleration=acceleration,
            name=name,
            neutral=neutral,
            default_rows=default_rows,
            length=length,
            gravity=gravity,
            kinematics_only=kinematics_only,
        )
        return cls(**robot_fields(urdf.read(source, tip, locked), wishes))

    @classmethod
    def from_mjcf(
        cls,
        source: Any,
        tip: str | None = None,
        locked: Sequence[str | int] = (),
        *,
        q_locked: Mapping[str, float] | None = None,
        limits: JointLimits | Mapping[str, Any] | None = None,
        acceleration: Any = None,
        name: str | None = None,
        neutral: Any = None,
        default_rows: Sequence[str] = ROWS,
        length: float | None = None,
        gravity: Any = None,
        kinematics_only: bool = False,
    ) -> Self:
        """A robot from a MuJoCo model file; the tip may be a body or a site.

        The arguments are those of ``from_pinocchio``. MJCF has no velocity or acceleration limit: give
        ``limits={"v_max": ...}``.

        Raises:
            InputError: the file cannot be read, an unknown tip or joint, or a wrong shape.
            ModelError: the robot is unsafe or not a chain; carries every finding.
        """
        wishes = Wishes(
            tip=tip,
            locked=locked,
            q_locked=q_locked,
            limits=limits,
            acceleration=acceleration,
            name=name,
            neutral=neutral,
            default_rows=default_rows,
            length=length,
            gravity=gravity,
            kinematics_only=kinematics_only,
        )
        return cls(**robot_fields(mjcf.read(source), wishes))

    @classmethod
    def from_dh(
        cls,
        table: Any,
        convention: str = "standard",
        *,
        limits: JointLimits | Mapping[str, Any] | None = None,
        acceleration: Any = None,
        name: str = "dh_arm",
        joints: Sequence[str] | None = None,
        prismatic: Sequence[int] = (),
        inertials: Sequence[Inertial | None] | None = None,
        base: Any = None,
        tool: Any = None,
        neutral: Any = None,
        default_rows: Sequence[str] = ROWS,
        length: float | None = None,
        gravity: Any = (0.0, 0.0, -9.81),
    ) -> Self:
        """A robot from a table of Denavit-Hartenberg parameters; see ``dh.model`` for the formula.

        Args:
            table: rows (theta, d, a, alpha), (n, 4) [rad, m, m, rad]; theta is the offset of the joint angle.
            convention: ``"standard"`` or ``"modified"``.
            limits: as in ``from_pinocchio``; None: no limits.
            acceleration: as in ``from_pinocchio``.
            name: of the robot.
            joints: joint names; None: j1, j2, ...
            prismatic: 0-based indices of joints that slide.
            inertials: mass of every link in its DH frame i; None: unknown.
            base: pose of DH frame 0 in the robot's base, (4, 4).
            tool: pose of the tip in the last DH frame, (4, 4).
            neutral: as in ``from_pinocchio``.
            default_rows: task rows the robot is meant for.
            length: characteristic length [m]; None: a sixth of the reach.
            gravity: in the base frame, (3,) [m/s2].

        Raises:
            InputError: a wrong shape or an unknown convention.
            ModelError: the robot is unsafe; carries every finding.
        """
        model = dh.model(
            table,
            convention,
            name=name,
            joints=joints,
            prismatic=prismatic,
            inertials=inertials,
            base=base,
            tool=tool,
            gravity=gravity,
        )
        return cls.from_pinocchio(
            model,
            dh.TIP,
            limits=limits,
            acceleration=acceleration,
            neutral=neutral,
            default_rows=default_rows,
            length=length,
        )
