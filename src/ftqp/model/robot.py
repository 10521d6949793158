"""A robot: joints, limits and tips of an arm or of a tree of arms, immutable and audited."""

import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Self, Unpack, final
from weakref import WeakKeyDictionary

import numpy as np
import pinocchio as pin

from ftqp.core.checks import BoolArray, FloatArray, array, frozen, instance
from ftqp.core.errors import InputError
from ftqp.core.picture import Picture, painted
from ftqp.core.pose import pose as checked_pose
from ftqp.model import audit
from ftqp.model.audit import UNKNOWN_TORQUE, Finding, Severity, friction_findings, rotor_findings
from ftqp.model.build import Shape, Wishes, robot_fields, write_friction, write_limits
from ftqp.model.capsules import WORLD, Capsule, Shapes, bodies_of, carried, checked
from ftqp.model.chain import Chain, chain_of, configuration_of, frame_id, positions_of
from ftqp.model.followers import coupled_columns, coupled_limits, coupled_places, coupled_square, followers_of
from ftqp.model.frames import way_to
from ftqp.model.limits import JointLimits, joined, one_each, part_of
from ftqp.model.payload import Payload
from ftqp.model.reading import urdf
from ftqp.model.reading.safe_xml import allowed_pairs
from ftqp.model.reading.source import Source, source_of
from ftqp.model.reduction import joint_index, named_frame, wanted_tips
from ftqp.model.robot_table import robot_html
from ftqp.model.serial import (
    EARTH,
    TIP,
    Inertial,
    base_limits,
    dh_model,
    free_base,
    free_base_limits,
    is_about_base,
    planar_base,
)
from ftqp.model.shape import dynamics_findings, neutral_of
from ftqp.model.urdf_text import urdf_text

_LOG = logging.getLogger("ftqp")
KEPT = 1024
"""Findings that are remembered to have been said. A convention."""
_MADE: WeakKeyDictionary[Any, tuple[Capsule, ...]] = WeakKeyDictionary()
"""What was made of the bodies of robots: a fit to meshes takes seconds."""


@lru_cache(KEPT)
def _say(name: str, finding: Finding) -> None:
    """Logs a finding; one that was said of a robot of that name is not said again."""
    level = logging.WARNING if finding.severity is Severity.WARNING else logging.INFO
    _LOG.log(level, "%s: %s", name, finding)


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False, weakref_slot=True)
class Robot:
    """An arm, or arms on one body, from base to tips; ``from_urdf``, ``from_mjcf`` and the like make it.

    Robots are never changed: ``with_limits`` and the like give another one. Wherever a method takes a
    configuration ``q``, that is joint positions, (nv,), or pinocchio's configuration, (nq,) [rad or m]; one
    of another shape, or with a number that is NaN or infinite, raises an InputError.

    Attributes:
        name: The robot's name.
        model: A pinocchio model in which every joint on the way to no tip is held. It is shared: change a
            copy, ``robot.model.copy()``.
        tips: The names of the frames that were asked for, one of a serial arm; the first is ``tip``.
        chain: Everything that the kernel knows of the robot.
        limits: The limits of its joints.
        neutral: A regular configuration well inside the limits, (nv,) [rad or m].
        default_rows: The task rows that the robot is meant for, of x, y, z, rx, ry, rz.
        length: The characteristic length, > 0 [m], by default a sixth of the reach. A larger one makes
            rotation count more next to position wherever a norm mixes them.
        findings: What the audit had to say; an unsafe robot is refused.
        shapes: The bodies as they were read or given; ``capsules`` is what is made of them.
    """

    name: str
    model: Any
    tips: tuple[str, ...]
    chain: Chain
    limits: JointLimits
    neutral: FloatArray
    default_rows: tuple[str, ...]
    length: float
    findings: tuple[Finding, ...]
    shapes: Shapes = ()

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
                  the model keeps. None takes the one that the model names ``home`` (or ``neutral``,
                  ``ready``, ``default``, ``half_sitting``: a keyframe of MJCF, a ``group_state`` of the
                  SRDF next to the URDF), else zero or mid-range where that is regular and the motors hold
                  it, else the best of 300 postures round the middle, the same every time.
                - ``default_rows``: The task rows that the robot is meant for, of x, y, z, rx, ry, rz.
                - ``length``: The characteristic length, > 0 [m]. A larger one makes rotation count more
                  next to position. None takes a sixth of the reach.
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
    def _read(
        cls, source: Source, wanted: Sequence[str], locked: Sequence[str | int], wishes: Wishes
    ) -> Self:
        """The robot of a file, whose findings are logged."""
        robot = cls(**robot_fields(source, wanted, locked, wishes))
        for finding in robot.findings:
            _say(robot.name, finding)
        return robot

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
            tip: The name of the controlled frame; this and the rest as in ``from_pinocchio``.
            locked: Joints to hold, by name or 0-based index.
            tips: The names of several frames to control in place of ``tip``.
            wishes: By keyword: limits, acceleration, neutral, default_rows, length, q_locked, name, gravity,
                mimics and kinematics_only.

        Raises:
            InputError: The file cannot be read; or as ``from_pinocchio``.
            ModelError: The robot is unsafe or cannot be expressed; the error carries every finding.
        """
        wanted = wanted_tips(tip, tips)
        return cls._read(urdf.read(source, wanted, locked), wanted, locked, wishes)

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

        Positions are those of MuJoCo's ``qpos`` and poses those in its world. The arm is what moves the end
        effector; the rest of a scene stands where the file has it, a free base too. What moves the arm in
        addition to the motors of its joints is a finding with the element's name, for ftqp knows nothing of
        it: ``gravcomp``, springs, tendons, loops, actuators at sites, a medium with a density, a range that
        is switched off. Of a body with an ``inertial`` no mesh is read. Keyframes of the whole scene are
        postures of the arm. An equality of joints that is not linear, and a ball joint on the way to the end
        effector, are refused; hold such a joint by ``locked``.

        MJCF has no limits of velocity or acceleration: give ``limits={"v_max": ...}``. Those of torque are
        the ``actuatorfrcrange`` of a joint, or what its actuators give together, whatever is less: their
        range of force, and of control where they are motors, times their gear.

        Args:
            source: The path of a file, or the XML itself.
            tip: The name of the controlled frame; this and the rest as in ``from_pinocchio``.
            locked: Joints to hold, by name or 0-based index.
            tips: The names of several frames to control in place of ``tip``.
            wishes: By keyword, as in ``from_urdf``.

        Raises:
            InputError: The file cannot be read; or as ``from_pinocchio``.
            ModelError: The robot is unsafe or cannot be expressed; the error carries every finding.
            MissingPackage: MuJoCo is not installed, which the extra ``sim`` brings.
        """
        from ftqp.model.reading.mjcf import read  # MuJoCo is optional

        wanted = wanted_tips(tip, tips)
        return cls._read(read(source, wanted, locked), wanted, locked, wishes)

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

        standard:  T_{i-1,i} = Rz(theta_i + q_i) Tz(d_i) Tx(a_i) Rx(alpha_i)
        modified:  T_{i-1,i} = Rx(alpha_i) Tx(a_i) Rz(theta_i + q_i) Tz(d_i), row i with alpha_{i-1}, a_{i-1}

        A sliding joint adds q_i to d_i instead of theta_i.

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
            wishes: As in ``from_pinocchio``: limits, acceleration, neutral, default_rows and length.

        Raises:
            InputError: A shape is wrong or the convention unknown.
            ModelError: The robot is unsafe; the error carries every finding.
        """
        model = dh_model(table, convention, name, joints, prismatic, inertials, base, tool, gravity)
        return cls.from_pinocchio(model, TIP, **wishes)

    def __repr__(self) -> str:
        """Name, joints and tip or tips."""
        ends = f"tip={self.tip!r}" if len(self.tips) == 1 else f"tips={self.tips!r}"
        return f"Robot({self.name!r}, joints={list(self.joints)}, {ends})"

    def _repr_html_(self) -> str:
        """Its joints with their limits, for notebooks."""
        return robot_html(self)

    def show(self, q: Any = None) -> Picture:
        """A picture of the arm from the side and from above, with each joint in its range.

        A notebook shows it, ``.save(file)`` keeps it; ``ftqp.view`` opens a page in which the arm can be
        turned.

        Args:
            q: The configuration, (nv,) or (nq,) [rad or m]; None is ``neutral``.

        Raises:
            MissingPackage: matplotlib is not installed.
        """
        picture: Picture = painted("robot", self, q)
        return picture

    @property
    def tip(self) -> str:
        """The name of the frame that a planner's ``task=`` drives."""
        return self.tips[0]

    @property
    def is_serial(self) -> bool:
        """Whether each joint hangs on the one before it, and the end effector on the last."""
        return self.chain.is_serial

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
        """Joint names, base to tips; a joint comes after the one that it hangs on."""
        return self.chain.names

    @property
    def continuous(self) -> BoolArray:
        """Joints that turn without limits, (nv,)."""
        return self.chain.continuous

    @property
    def viscous(self) -> FloatArray:
        """Viscous friction of the joints, (nv,) [N m s/rad or N s/m]; all torques count it."""
        return self.chain.viscous

    @property
    def coulomb(self) -> FloatArray:
        """Coulomb friction of the joints, (nv,) [N m or N]: data for simulations, in no planner's torque."""
        return self.chain.coulomb

    @property
    def has_inertia(self) -> bool:
        """Whether masses are known, so that torques can be limited and minimised."""
        return self.chain.has_inertia

    def joint(self, name_or_index: str | int) -> int:
        """The 0-based index of a joint.

        Args:
            name_or_index: The joint's name, or its 0-based index, which is returned as it is.

        Raises:
            InputError: There is no such joint; the message names the valid ones and the nearest.
        """
        return joint_index(self.joints, name_or_index, self.name)

    def angles(self, q: Any) -> FloatArray:
        """Joint positions, (nv,) [rad or m], of a configuration.

        Args:
            q: The configuration, (nv,) or (nq,) [rad or m].
        """
        return positions_of(self.model, self.continuous, q)

    def configuration(self, q: Any) -> FloatArray:
        """pinocchio's configuration, (nq,) [rad or m], of a configuration.

        Args:
            q: The configuration, (nv,) or (nq,) [rad or m].
        """
        return configuration_of(self.model, self.continuous, self.angles(q))

    def pose(self, q: Any, frame: str | None = None) -> FloatArray:
        """Pose T_WE of the end effector, or of another frame, (4, 4) [m].

        Args:
            q: The configuration, (nv,) or (nq,) [rad or m].
            frame: The name of any frame of the model; None is ``tip``.

        Raises:
            InputError: There is no such frame.
        """
        data, number = self.model.createData(), self._frame(frame)
        pin.forwardKinematics(self.model, data, self.configuration(q))
        pin.updateFramePlacements(self.model, data)
        return np.array(data.oMf[number].homogeneous)

    def jacobian(self, q: Any, frame: str | None = None) -> FloatArray:
        """J of the end effector or another frame, (6, nv): rows x, y, z, rx, ry, rz along the base's axes.

        The angular rows are in rad: unlike the planner's rows they are not multiplied by ``length``. A joint
        that does not move the frame has a column of zeros, and that of a follower is added to its leader's.

        Args:
            q: The configuration, (nv,) or (nq,) [rad or m].
            frame: The name of any frame of the model; None is ``tip``.

        Raises:
            InputError: There is no such frame.
        """
        data, number = self.model.createData(), self._frame(frame)
        J = pin.computeFrameJacobian(self.model, data, self.configuration(q), number, pin.LOCAL_WORLD_ALIGNED)
        return coupled_columns(self.chain, np.array(J).reshape(6, self.nv))

    def mass_matrix(self, q: Any) -> FloatArray:
        """M, (nv, nv) [kg m2 or kg], rotor inertias included: tau = M a + h.

        A joint that follows another has a row of zeros: its leader's motor moves it.

        Args:
            q: The configuration, (nv,) or (nq,) [rad or m].

        Raises:
            InputError: The robot has no masses.
        """
        self._needs_masses("mass matrix")
        M = np.array(pin.crba(self.model, self.model.createData(), self.configuration(q)))
        return coupled_square(self.chain, np.triu(M) + np.triu(M, 1).T)

    def bias(self, q: Any, v: Any) -> FloatArray:
        """h, (nv,) [N m or N]: gravity, Coriolis and centrifugal terms and viscous friction, tau = M a + h.

        Args:
            q: The configuration, (nv,) or (nq,) [rad or m].
            v: The velocity, (nv,) [rad/s or m/s].

        Raises:
            InputError: ``v`` is not (nv,) finite numbers, or the robot has no masses.
        """
        self._needs_masses("bias")
        speed = array("v", v, (self.nv,), "(nv,)")
        data = self.model.createData()
        h = pin.nonLinearEffects(self.model, data, self.configuration(q), speed)
        return coupled_columns(self.chain, np.asarray(h + self.viscous * speed))

    def refuse_tree(self, what: str) -> None:
        """Refuses a robot whose joints are not all on the way to its tip, or follow others, or that floats.

        Args:
            what: What needs another robot, the beginning of the sentence, such as ``coverage needs``.
        """
        self.refuse_followers(what)
        if not self.is_serial:
            raise InputError(
                f"{what} one serial arm, but {self.name} has joints off the way to its end effector "
                f"{self.tip!r}; take robot.arm_to({self.tip!r}), or that of another frame"
            )
        self.refuse_floating(what)

    def refuse_followers(self, what: str) -> None:
        """Refuses a robot of which a joint follows another one.

        Args:
            what: What needs another robot, the beginning of the sentence, such as ``coverage needs``.
        """
        for name, one in followers_of(self.joints, self.chain).items():
            raise InputError(
                f"{what} a motor at every joint, but {name!r} of {self.name} mimics {one.leader!r}; hold "
                f"{name!r} with locked=[{name!r}], or read the robot with a tip before it"
            )

    def refuse_floating(self, what: str) -> None:
        """Refuses a robot whose base floats.

        Args:
            what: What needs another robot, the beginning of the sentence, such as ``coverage needs``.
        """
        if self.chain.floating:
            raise InputError(
                f"{what} a base that stands, but {self.name} floats (on_free_base), and nothing there keeps "
                "its momentum; take the robot without that base"
            )

    def refuse_unknown_torques(self, what: str) -> None:
        """Refuses a robot whose file has no torque limit of any motor, where nobody has given them since.

        Args:
            what: What needs another robot, the beginning of the sentence, such as ``coverage needs``.
        """
        if any(finding.about == UNKNOWN_TORQUE for finding in self.findings):
            raise InputError(
                f"{what}, and the file of {self.name} has no torque limits (effort 0 or missing); give them "
                "by robot.with_limits(tau_max=...), inf where a motor has none"
            )

    def _frame(self, name: str | None) -> int:
        return frame_id(self.model, self.tip) if name is None else named_frame(self.model, name)

    def _needs_masses(self, what: str) -> None:
        if not self.has_inertia:
            raise InputError(f"{self.name} has no masses, so no {what}; give the model its masses first")

    @property
    def capsules(self) -> tuple[Capsule, ...]:
        """The bodies as capsules, base to tips, each in the frame of a link or joint.

        They are those of ``with_capsules``, or contain the collision geometry of the URDF; where there is
        none they go from joint to joint, with a radius of a twentieth of the reach, and say so. Meshes are
        read when this is first asked for, which takes seconds.

        Raises:
            InputError: A mesh is missing, or holds nothing.
        """
        if self not in _MADE:
            from ftqp.model.collision_geometry import bodies_of  # it loads scipy, which few calls need

            _MADE[self] = bodies_of(self)
        return _MADE[self]

    def allowed_pairs(self, srdf: Any) -> tuple[tuple[str, str], ...]:
        """The pairs of bodies that an SRDF, MoveIt's file next to a URDF, lets touch.

        Capsules belong to the link that is their frame, or that they are called after. The pairs are for
        ``ftqp.Clearance(ignore=...)``; those of links without capsules are left out.

        Args:
            srdf: The path of the file, or the XML itself.

        Raises:
            InputError: The file cannot be read, or a mesh of the robot is missing.
        """
        of: dict[str, list[str]] = {}
        for one in self.capsules:
            for name in {one.frame or "", one.label.partition(" ")[0]}:
                of.setdefault(name, []).append(one.label)
        return tuple(
            (one, other)
            for first, second in allowed_pairs(srdf)
            for one in of.get(first, ())
            for other in of.get(second, ())
        )

    def to_urdf(self) -> str:
        """This robot as the text of a URDF, which ``from_urdf`` reads back to rounding.

        A link stands behind each joint, with its inertia and with cylinders to look at; the joint turns about
        or slides along its own z axis, and fixed joints end in the tips. A turning joint without end stops
        becomes a ``continuous`` one. Readers of URDF sort joints that hang on one link by name, so those of
        several arms may come back in another order. Limits of acceleration and jerk are written as in URDF
        1.2, those of acceleration and rotor inertias as Drake's extensions, too; older tools skip them.
        Gravity, ``neutral``, ``default_rows`` and ``length`` are no part of a URDF: hand them to
        ``from_urdf``. For tools that do not read Drake's extension the arm has no rotors: give MuJoCo its
        ``armature`` by hand. MuJoCo refuses arms without masses, and the thin rods of ``planar`` and
        ``planar6``.

        Raises:
            InputError: A name cannot stand in XML.
        """
        return urdf_text(self.name, self.model, self.tips, self.chain, self.limits)

    def _remade(
        self,
        model: Any,
        *tips: str,
        dropped: Sequence[str] = (),
        said: Iterable[Finding] = (),
        **changes: Any,
    ) -> Self:
        """The robot of another model, its chain anew, and findings in place of those about some things."""
        found = (*(one for one in self.findings if one.about not in dropped), *said)
        audit.refuse_unsafe(self.name, found)
        tips = tips or self.tips
        chain = chain_of(model, tips[0], followers=followers_of(self.joints, self.chain))
        return replace(self, model=model, tips=tips, chain=chain, findings=found, **changes)

    def with_limits(
        self,
        *,
        q_min: Any = None,
        q_max: Any = None,
        v_max: Any = None,
        a_max: Any = None,
        tau_max: Any = None,
        j_max: Any = None,
    ) -> Self:
        """This robot with some limits replaced; None keeps what there is.

        Each is (nv,), one number for all joints, or a mapping of some joints to numbers:
        ``robot.with_limits(v_max={"elbow": 1.0})`` leaves the others as they are.

        A new ``v_max`` brings the acceleration limit ``v_max / RISE_TIME`` to joints that have none.

        Args:
            q_min: The lowest position [rad or m].
            q_max: The highest position [rad or m].
            v_max: The largest speed, > 0 [rad/s or m/s].
            a_max: The largest acceleration, > 0 [rad/s2 or m/s2].
            tau_max: The largest torque or force, > 0 [N m or N].
            j_max: The largest jerk, > 0 [rad/s3 or m/s3], which motions to a posture keep.

        Raises:
            InputError: A limit has a wrong shape.
            ModelError: The limits are unsafe.
        """
        given = {"q_min": q_min, "q_max": q_max, "v_max": v_max, "a_max": a_max, "tau_max": tau_max}
        given["j_max"] = j_max
        changes = {name: value for name, value in given.items() if value is not None}
        names, chain = self.joints, self.chain
        limits, crossed = coupled_limits(names, chain, self.limits.replaced(changes, names))
        model = self.model.copy()
        write_limits(model, limits)
        now = [{key: getattr(self.limits, key)[i] for key in given} for i in range(self.nv)]
        said = [*crossed, *audit.widened(names, now, changes)]
        said += audit.limit_findings(names, limits, chain.continuous, chain.prismatic)
        said += friction_findings(names, model.damping, model.friction, limits)
        start = frozen(coupled_places(chain, neutral_of(limits, self.neutral)))
        dropped = ("limits", "friction", *changes)
        return self._remade(model, dropped=dropped, said=said, limits=limits, neutral=start)

    def with_friction(self, *, viscous: Any = None, coulomb: Any = None) -> Self:
        """This robot with other joint friction, each (nv,) or one number for all; None keeps what there is.

        Args:
            viscous: Viscous friction, >= 0 [N m s/rad or N s/m]. It is a part of every torque: of
                ``step.tau``, of the torque limits, and of the motion of a free-swinging joint.
            coulomb: Coulomb friction, >= 0 [N m or N]: for simulated arms, detectors and rollouts of a free
                joint. The planner does not feed it forward, for near rest its sign flips and the arm hunts.

        Raises:
            InputError: A wrong shape, or a robot without masses.
            ModelError: A friction is negative or not finite.
        """
        self._needs_masses("torques")
        model = self.model.copy()
        write_friction(
            model,
            self.viscous if viscous is None else one_each("viscous", viscous, self.nv),
            self.coulomb if coulomb is None else one_each("coulomb", coulomb, self.nv),
        )
        said = friction_findings(self.joints, model.damping, model.friction, self.limits)
        return self._remade(model, dropped=("friction",), said=said)

    def with_rotors(self, inertia: Any) -> Self:
        """This robot with other rotors, as seen from the joints behind gears: inertia times ratio squared.

        URDF has no field for them, and behind a gear a rotor can be most of what a joint accelerates.

        Args:
            inertia: Rotor inertia, (nv,) or one number for all, >= 0 [kg m2, or kg where a joint slides].

        Raises:
            InputError: A wrong shape, or a robot without masses.
            ModelError: An inertia is negative or not finite.
        """
        self._needs_masses("torques")
        model = self.model.copy()
        model.armature = one_each("inertia", inertia, self.nv)
        return self._remade(model, said=rotor_findings(self.joints, model.armature))

    def with_payload(self, payload: Payload) -> Self:
        """This robot with one more load at its end effector, the first of several.

        Args:
            payload: The load, in the frame of the tip.

        Raises:
            InputError: This is no payload, or a robot without masses.
        """
        instance("payload", payload, Payload, "an ftqp.Payload, ftqp.Payload(mass=0.5)")
        if not self.has_inertia:
            raise InputError(
                f"{self.name} has no masses, so a payload means nothing to it; give the model its masses"
            )
        model = self.model.copy()
        frame = model.frames[frame_id(model, self.tip)]
        body = pin.Inertia(payload.mass, np.array(payload.com), np.array(payload.inertia))
        model.appendBodyToJoint(frame.parentJoint, body, frame.placement)
        return self._remade(model)

    def with_tip(self, T: Any, name: str = "tool") -> Self:
        """This robot with another controlled frame in place of its tip, the first of several.

        Masses, the characteristic length and further tips stay.

        Args:
            T: Pose of the new tip in the frame of the present one, (4, 4) [m].
            name: The name of the new frame.

        Raises:
            InputError: T is no pose, or the name is taken.
        """
        if any(frame.name == name for frame in self.model.frames):
            raise InputError(f"{name!r} is already a frame of {self.name}; give the new tip another name=")
        model, number = self.model.copy(), frame_id(self.model, self.tip)
        frame = model.frames[number]
        at = frame.placement * pin.SE3(checked_pose(T, "T"))
        model.addFrame(pin.Frame(name, frame.parentJoint, number, at, pin.FrameType.OP_FRAME))
        return self._remade(model, name, *self.tips[1:])

    def with_first_tip(self, frame: str) -> Self:
        """This robot with another of its tips, or another frame, as the first: paths and goals are of that.

        Joints, their order, masses, limits and the characteristic length stay, and so do the other tips.

        Args:
            frame: The name of a tip, or of a frame, link or joint of the model that moves with a joint.

        Raises:
            InputError: There is no such frame.
            ModelError: No joint moves it.
        """
        named_frame(self.model, frame)
        return self._remade(self.model, frame, *(tip for tip in self.tips if tip != frame))

    def with_capsules(self, capsules: Iterable[Capsule] | Self) -> Self:
        """This robot with other bodies, for distances.

        Args:
            capsules: Rods with round ends, each with the ``frame`` that it moves with. Or another model of
                the same arm, as its maker's URDF with meshes: its bodies are taken, hulls of meshes included.

        Raises:
            InputError: This is no list of capsules with frames of this robot, or a model of another arm.
        """
        given = bodies_of(capsules, self) if isinstance(capsules, Robot) else checked(capsules)
        for one in given:
            if one.frame != WORLD:
                named_frame(self.model, one.frame)
        return replace(self, shapes=given)

    def arm_to(self, frame: str) -> Self:
        """The serial arm from the base to one frame: what studies of one arm ask of a robot with several.

        Its joints are those on the way, in their order, with their limits; all others are held where
        ``neutral`` has them. Limits, masses, the base and the characteristic length stay.

        Args:
            frame: The name of a tip, or of a frame, link or joint of the model that moves with a joint.

        Raises:
            InputError: There is no such frame.
            ModelError: No joint moves it.
        """
        way = way_to(self, frame)
        held = {self.joints[i]: float(self.neutral[i]) for i in range(self.nv) if i not in way}
        arm = self._composed(
            self.model, (frame,), part_of(self.limits, way), self.neutral[way],
            locked=[*held], q_locked=held, name=self.name,
        )  # fmt: skip
        return replace(arm, findings=self._lasting, shapes=self.shapes)

    def on_planar_base(
        self,
        *,
        v_max: Any,
        a_max: Any,
        q_range: Any = None,
        tau_max: Any = np.inf,
        inertial: Inertial | None = None,
    ) -> Self:
        """This robot on a base that drives in the plane in any direction.

        Three joints come before its own, ``base_x`` and ``base_y``, which slide along the axes of the world,
        and ``base_yaw``, which turns about z without end; a planner plans, limits and locks them as it does
        any other. Poses are in the world then. The characteristic length stays that of the arm.

        Args:
            v_max: The largest speeds of x, y and yaw, > 0, (3,) or one number [m/s, m/s, rad/s].
            a_max: The largest accelerations, > 0, (3,) or one number [m/s2, m/s2, rad/s2].
            q_range: The room of the base: lowest and highest x, then y, (2, 2), or one number for so far to
                every side [m]. None is 10 m to every side.
            tau_max: The largest forces and torque, > 0, (3,) or one number [N, N, N m]; infinite is no limit.
            inertial: The mass of the base in its own frame; None adds nothing to what stands on it.

        Raises:
            InputError: A shape is wrong, the robot stands on such a base already, a base with a mass is to
                carry a robot without masses, or one without a mass leaves the inertia singular.
            ModelError: The limits are unsafe.
        """
        if inertial is not None:
            instance("inertial", inertial, Inertial, "an ftqp.model.serial.Inertial or None")
            self._needs_masses("base with a mass")
        base = base_limits(v_max, a_max, q_range, tau_max)
        model = planar_base(self.model, inertial)
        if inertial is None and any(f.severity is Severity.UNSAFE for f in dynamics_findings(model)):
            raise InputError(
                f"a base without a mass leaves the joint-space inertia of {self.name} singular, for a joint "
                "turns about the same axis as the base; give inertial=..., the mass of the base"
            )
        return self._on_base(model, base)

    def on_free_base(self, inertial: Inertial) -> Self:
        """This robot on a body that floats in space, such as a satellite: no force holds it, no gravity.

        Six joints come before its own, ``float_x`` to ``float_z`` along the axes of space and ``float_yaw``,
        ``float_pitch``, ``float_roll`` about z, y and x; no motor moves them. A planner moves the others so
        that linear and angular momentum stay 0 and the end effector follows its target in space: at the
        acceleration level by M_b a + h_b = 0, at the velocity level by M_b v = 0, the rows of M that belong
        to the base. The whole is at rest at a reset. The pitch is kept within 1.4 rad, for yaw and roll are
        one at a right angle.

        Args:
            inertial: The mass of the body, in its frame.

        Raises:
            InputError: The robot has no masses, or stands on such a body already.
            ModelError: The mass is unsafe.

        Source: Umetani and Yoshida 1989, whose generalised Jacobian is J with M_b v = 0 put in.
        """
        instance("inertial", inertial, Inertial, "an ftqp.model.serial.Inertial")
        self._needs_masses("base that floats")
        return self._on_base(free_base(self.model, inertial), free_base_limits())

    def _on_base(self, model: Any, base: JointLimits) -> Self:
        neutral = np.concatenate([neutral_of(base, None), self.neutral])
        whole = self._composed(model, self.tips, joined(base, self.limits), neutral)
        more = [f for f in whole.findings if f not in self._lasting and not is_about_base(f)]
        shapes = carried(self.shapes, whole.joints[len(base) - 1])
        return replace(whole, findings=(*self._lasting, *more), shapes=shapes)

    @property
    def _lasting(self) -> tuple[Finding, ...]:
        """What was found that is as true of a robot that is put together of this one."""
        return tuple(one for one in self.findings if one.about not in ("limits", "friction", "masses"))

    def _composed(
        self, model: Any, tips: Sequence[str], limits: JointLimits, neutral: FloatArray, **wishes: Any
    ) -> Self:
        """The robot of a model to which joints were added, or of which some are held."""
        led = followers_of(self.joints, self.chain)
        return self.from_pinocchio(
            model, tips=tips, limits=limits, neutral=neutral, default_rows=self.default_rows,
            length=self.length, mimics={n: (f.leader, f.ratio, f.offset) for n, f in led.items()}, **wishes,
        )  # fmt: skip
