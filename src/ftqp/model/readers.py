"""The ways in which a robot is made: from a pinocchio model, a URDF, a MuJoCo file, or a DH table."""

from collections.abc import Mapping, Sequence
from typing import Any, Self

import pinocchio as pin

from ftqp.core.checks import instance
from ftqp.model.build import ROWS, Wishes, robot_fields
from ftqp.model.limits import JointLimits
from ftqp.model.reading import dh, mjcf, urdf
from ftqp.model.reading.source import source_of
from ftqp.model.serial import Inertial


class Readers:
    """The class methods that make a ``Robot``."""

    __slots__ = ()

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
            model: The pinocchio model.
            tip: The name of the controlled frame; None takes the only end of the model.
            locked: Joints to hold, by name or 0-based index; joints off the chain are held anyway.
            q_locked: Positions of held joints by name [rad or m]; a joint without an entry is held at
                neutral.
            limits: Limits that replace the model's, all or some (``{"v_max": 1.0}``), each (nv,) or one
                number.
            acceleration: The acceleration limit a_max, (nv,) or one number, > 0 [rad/s2 or m/s2]. A larger
                one lets the arm brake later and harder. None takes ``v_max / RISE_TIME``, and a finding says
                so.
            name: The robot's name; None takes the model's.
            neutral: A configuration inside the limits, (nv,) [rad or m], or the name of one that the model
                keeps. None takes a posture that the model names, or a regular one in the middle of the range,
                see ``ftqp.model.neutral.neutral_posture``.
            default_rows: The task rows that the robot is meant for, of x, y, z, rx, ry, rz.
            length: The characteristic length, > 0 [m]. A larger one makes rotation count more beside
                position. None takes a sixth of the reach.
            gravity: Gravity in the base frame, (3,) [m/s2]; None takes the model's.
            kinematics_only: Whether masses and rotor inertias are dropped; torques are then neither limited
                nor minimised.

        Raises:
            InputError: A tip or joint is unknown, or a shape is wrong.
            ModelError: The robot is unsafe or not a chain; the error carries every finding.
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
        instance("model", model, pin.Model, "a pinocchio.Model; files are read by from_urdf and from_mjcf")
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
        """A robot from a URDF; meshes are not loaded.

        Limits of acceleration, deceleration and jerk are read as URDF 1.2 has them, and those of acceleration
        as Drake has them. A joint has one ``a_max``, with which it also brakes: the smallest of them, and a
        finding says so where they differ. Where a file has none, give ``acceleration``, or
        ``v_max / RISE_TIME`` is taken, and a finding says what the torques would allow.

        Args:
            source: The path of a file, or the XML itself.
            tip: The name of the controlled frame; None takes the only end of the model.
            locked: Joints to hold, by name or 0-based index; joints off the chain are held anyway.
            q_locked: Positions of held joints by name as in ``from_pinocchio`` [rad or m].
            limits: Limits that replace the model's, as in ``from_pinocchio``.
            acceleration: The acceleration limit as in ``from_pinocchio``.
            name: The robot's name; None takes the model's.
            neutral: A configuration inside the limits as in ``from_pinocchio``.
            default_rows: The task rows that the robot is meant for, of x, y, z, rx, ry, rz.
            length: The characteristic length as in ``from_pinocchio``, > 0 [m].
            gravity: Gravity in the base frame, (3,) [m/s2]; None takes the model's.
            kinematics_only: Whether masses are dropped as in ``from_pinocchio``.

        Raises:
            InputError: The file cannot be read, a tip or joint is unknown, or a shape is wrong.
            ModelError: The robot is unsafe or not a chain; the error carries every finding.
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

        MJCF has no limits of velocity or acceleration: give ``limits={"v_max": ...}``.

        Args:
            source: The path of a file, or the XML itself.
            tip: The name of the controlled frame; None takes the only end of the model.
            locked: Joints to hold, by name or 0-based index; joints off the chain are held anyway.
            q_locked: Positions of held joints by name as in ``from_pinocchio`` [rad or m].
            limits: Limits that replace the model's, as in ``from_pinocchio``.
            acceleration: The acceleration limit as in ``from_pinocchio``.
            name: The robot's name; None takes the model's.
            neutral: A configuration inside the limits as in ``from_pinocchio``.
            default_rows: The task rows that the robot is meant for, of x, y, z, rx, ry, rz.
            length: The characteristic length as in ``from_pinocchio``, > 0 [m].
            gravity: Gravity in the base frame, (3,) [m/s2]; None takes the model's.
            kinematics_only: Whether masses are dropped as in ``from_pinocchio``.

        Raises:
            InputError: The file cannot be read, a tip or joint is unknown, or a shape is wrong.
            ModelError: The robot is unsafe or not a chain; the error carries every finding.
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
        """A robot from a table of Denavit-Hartenberg parameters.

        The formula is that of ``ftqp.model.reading.dh.model``.

        Args:
            table: Rows (theta, d, a, alpha), (n, 4) [rad, m, m, rad]; theta is the offset of the joint angle.
            convention: ``standard`` or ``modified``.
            limits: Limits as in ``from_pinocchio``; None is no limits.
            acceleration: The acceleration limit as in ``from_pinocchio``.
            name: The robot's name.
            joints: Names of the joints; None is j1, j2, ...
            prismatic: 0-based indices of the joints that slide.
            inertials: The mass of every link in its DH frame i; None is unknown.
            base: Pose of DH frame 0 in the robot's base, (4, 4); None is the base itself.
            tool: Pose of the tip in the last DH frame, (4, 4); None is that frame.
            neutral: A configuration inside the limits as in ``from_pinocchio``.
            default_rows: The task rows that the robot is meant for, of x, y, z, rx, ry, rz.
            length: The characteristic length as in ``from_pinocchio``, > 0 [m]; None takes a sixth of the
                reach.
            gravity: Gravity in the base frame, (3,) [m/s2].

        Raises:
            InputError: A shape is wrong or the convention unknown.
            ModelError: The robot is unsafe; the error carries every finding.
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
