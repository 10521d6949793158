"""The ways in which a robot is made: from a pinocchio model, a URDF, a MuJoCo file, or a DH table."""

import logging
from collections.abc import Sequence
from functools import lru_cache
from importlib import import_module
from typing import Any, Self, Unpack

import pinocchio as pin

from ftqp.core.checks import instance
from ftqp.model.audit import Finding, Severity
from ftqp.model.build import Shape, Wishes, robot_fields
from ftqp.model.reading import dh, urdf
from ftqp.model.reading.source import source_of
from ftqp.model.reduction import wanted_tips
from ftqp.model.serial import EARTH, Inertial

_LOG = logging.getLogger("ftqp")
KEPT = 1024
"""Findings that are remembered to have been said. A convention."""


def _told(fields: dict[str, Any]) -> dict[str, Any]:
    """The fields of a robot that was just read, once its findings are logged."""
    for finding in fields["findings"]:
        _say(fields["name"], finding)
    return fields


@lru_cache(KEPT)
def _say(name: str, finding: Finding) -> None:
    """Logs a finding; one that was said of a robot of that name is not said again."""
    level = logging.WARNING if finding.severity is Severity.WARNING else logging.INFO
    _LOG.log(level, "%s: %s", name, finding)


class Readers:
    """The class methods that make a ``Robot``."""

    __slots__ = ()

    @classmethod
    def from_pinocchio(
        cls,
        model: Any,
        tip: str | None = None,
        locked: Sequence[str | int] = (),
        tips: Sequence[str] | None = None,
        **wishes: Unpack[Wishes],
    ) -> Self:
        """A robot from a pinocchio model, which is copied.

        Args:
            model: The pinocchio model.
            tip: The name of the controlled frame; None takes the only end of the model.
            locked: Joints to hold, by name or 0-based index; joints on the way to no tip are held anyway.
            tips: The names of several frames to control in place of ``tip``, such as the hands of a robot
                with two arms: the joints on the way to any of them stay. The first one is ``robot.tip``.
            wishes: Keyword arguments, each of which may be left out:

                - ``limits``: Limits that replace the model's, all or some, each (nv,), one number for all
                  joints, or some joints by name: ``{"v_max": 1.0, "q_max": {"elbow": 2.3}}``.
                - ``acceleration``: The acceleration limit a_max, (nv,) or one number, > 0 [rad/s2 or m/s2]. A
                  larger one lets the arm brake later and harder. None takes ``v_max / RISE_TIME``, and a
                  finding says so.
                - ``neutral``: A configuration inside the limits, (nv,) [rad or m], or the name of one that
                  the model keeps. None takes a posture that the model names, or a regular one in the middle
                  of the range, see ``ftqp.model.neutral.neutral_posture``.
                - ``default_rows``: The task rows that the robot is meant for, of x, y, z, rx, ry, rz.
                - ``length``: The characteristic length, > 0 [m]. A larger one makes rotation count more
                  beside position. None takes a sixth of the reach.
                - ``q_locked``: Positions of held joints by name [rad or m]; a joint without an entry is held
                  at neutral.
                - ``name``: The robot's name; None takes the model's.
                - ``gravity``: Gravity in the base frame, (3,) [m/s2]; None takes the model's.
                - ``mimics``: Joints that follow others, such as ``{"lift2": ("lift", 0.5, 0.02)}``: each
                  with the joint that it follows, or with that, the ratio of its motion to the leader's and
                  where it is when the leader is at 0 [rad or m]. They stand before those of a file.
                - ``kinematics_only``: Whether masses and rotor inertias are dropped; torques are then neither
                  limited nor minimised.

        Raises:
            InputError: A tip or joint is unknown, both ``tip`` and ``tips`` are given, or a shape is wrong.
            ModelError: The robot is unsafe or cannot be expressed; the error carries every finding.
        """
        instance("model", model, pin.Model, "a pinocchio.Model; files are read by from_urdf and from_mjcf")
        return cls(**robot_fields(source_of(model), wanted_tips(tip, tips), locked, wishes))

    @classmethod
    def from_urdf(
        cls,
        source: Any,
        tip: str | None = None,
        locked: Sequence[str | int] = (),
        tips: Sequence[str] | None = None,
        **wishes: Unpack[Wishes],
    ) -> Self:
        """A robot from a URDF; meshes are not loaded.

        Limits of acceleration, deceleration and jerk are read as URDF 1.2 has them, and those of acceleration
        as Drake has them. A joint has one ``a_max``, with which it also brakes: the smallest of them, and a
        finding says so where they differ. Where a file has none, give ``acceleration``, or
        ``v_max / RISE_TIME`` is taken, and a finding says what the torques would allow.

        Args:
            source: The path of a file, or the XML itself.
            tip: The name of the controlled frame; None takes the only end of the model.
            locked: Joints to hold, by name or 0-based index; joints on the way to no tip are held anyway.
            tips: The names of several frames to control in place of ``tip``, such as the hands of a robot
                with two arms: the joints on the way to any of them stay. The first one is ``robot.tip``.
            wishes: By keyword, as in ``from_pinocchio``: limits, acceleration, neutral, default_rows, length,
                q_locked, name, gravity, mimics and kinematics_only.

        Raises:
            InputError: The file cannot be read, a tip or joint is unknown, both ``tip`` and ``tips`` are
                given, or a shape is wrong.
            ModelError: The robot is unsafe or cannot be expressed; the error carries every finding.
        """
        wanted = wanted_tips(tip, tips)
        return cls(**_told(robot_fields(urdf.read(source, wanted, locked), wanted, locked, wishes)))

    @classmethod
    def from_mjcf(
        cls,
        source: Any,
        tip: str | None = None,
        locked: Sequence[str | int] = (),
        tips: Sequence[str] | None = None,
        **wishes: Unpack[Wishes],
    ) -> Self:
        """A robot from a MuJoCo model file, as MuJoCo compiles it; the tip is a site, body or named frame.

        Positions are those of MuJoCo's ``qpos`` and poses those in its world. The arm is what moves the tip;
        the rest of a scene stands where the file has it, a free base too. What moves the arm beside the
        motors of its joints, such as ``gravcomp``, springs, tendons and loops, is a finding.

        MJCF has no limits of velocity or acceleration: give ``limits={"v_max": ...}``. Those of torque are
        the ``actuatorfrcrange`` of a joint, or what its actuators give together, whatever is less: their
        range of force, and of control where they are motors, times their gear.

        Args:
            source: The path of a file, or the XML itself.
            tip: The name of the controlled frame; None takes the only end of the model.
            locked: Joints to hold, by name or 0-based index; joints on the way to no tip are held anyway.
            tips: The names of several frames to control in place of ``tip``, such as the hands of a robot
                with two arms: the joints on the way to any of them stay. The first one is ``robot.tip``.
            wishes: By keyword, as in ``from_pinocchio``: limits, acceleration, neutral, default_rows, length,
                q_locked, name, gravity, mimics and kinematics_only.

        Raises:
            InputError: The file cannot be read, a tip or joint is unknown, both ``tip`` and ``tips`` are
                given, or a shape is wrong.
            ModelError: The robot is unsafe or cannot be expressed; the error carries every finding.
            MissingPackage: MuJoCo is not installed, which the extra ``sim`` brings.
        """
        wanted = wanted_tips(tip, tips)
        read = import_module("ftqp.model.reading.mjcf").read  # MuJoCo is optional
        return cls(**_told(robot_fields(read(source, wanted, locked), wanted, locked, wishes)))

    @classmethod
    def from_dh(
        cls,
        table: Any,
        convention: str = "standard",
        *,
        name: str = "dh_arm",
        joints: Sequence[str] | None = None,
        prismatic: Sequence[int] = (),
        inertials: Sequence[Inertial | None] | None = None,
        base: Any = None,
        tool: Any = None,
        gravity: Any = EARTH,
        **wishes: Unpack[Shape],
    ) -> Self:
        """A robot from a table of Denavit-Hartenberg parameters.

        The formula is that of ``ftqp.model.reading.dh.model``.

        Args:
            table: Rows (theta, d, a, alpha), (n, 4) [rad, m, m, rad]; theta is the offset of the joint angle.
            convention: ``standard`` or ``modified``.
            name: The robot's name.
            joints: Names of the joints; None is j1, j2, ...
            prismatic: 0-based indices of the joints that slide.
            inertials: The mass of every link in its DH frame i; None is unknown.
            base: Pose of DH frame 0 in the robot's base, (4, 4); None is the base itself.
            tool: Pose of the tip in the last DH frame, (4, 4); None is that frame.
            gravity: Gravity in the base frame, (3,) [m/s2].
            wishes: By keyword, as in ``from_pinocchio``: limits, acceleration, neutral, default_rows and
                length.

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
        return cls.from_pinocchio(model, dh.TIP, **wishes)
