"""A robot: joints, limits and tips of an arm or of a tree of arms, immutable and audited."""

from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any, Self, cast, final

import numpy as np
import pinocchio as pin

from ftqp.core.checks import BoolArray, FloatArray, array, frozen, instance
from ftqp.core.errors import InputError
from ftqp.core.picture import Picture
from ftqp.model import audit
from ftqp.model.arm_on_way import wishes_of
from ftqp.model.audit import Finding, rotor_findings
from ftqp.model.build import write_limits
from ftqp.model.chain import Chain, chain_of, configuration_of, frame_id, positions_of
from ftqp.model.embodied import Embodied, Shapes, carried
from ftqp.model.followers import (
    coupled_columns,
    coupled_limits,
    coupled_places,
    coupled_square,
    followers_of,
)
from ftqp.model.grafting import base_limits, free_base, free_base_limits, is_about_base, planar_base
from ftqp.model.limits import JointLimits, joined, one_each
from ftqp.model.payload import Payload
from ftqp.model.readers import Readers
from ftqp.model.reduction import joint_index, named_frame
from ftqp.model.refitting import friction_findings, loaded, with_friction, with_rotors, with_tip
from ftqp.model.robot_table import robot_html
from ftqp.model.serial import Inertial
from ftqp.model.shape import dynamics_findings, neutral_of
from ftqp.model.urdf_text import urdf_text


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False, weakref_slot=True)
class Robot(Embodied, Readers):
    """An arm, or arms on one body, from base to tips; ``from_urdf``, ``from_mjcf`` and the like make it.

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
            rotation count more beside position wherever a norm mixes them.
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
            InputError: The shape is another one, or a number is NaN or infinite.
            MissingPackage: matplotlib is not installed.
        """
        # pictures are above the model: a robot looks its own up by name, and knows nothing of it
        draw = import_module("ftqp.viz.figures.shown").robot_picture
        return cast("Picture", draw(self, q))

    @property
    def tip(self) -> str:
        """The name of the frame that a planner's ``task=`` drives."""
        return self.tips[0]

    @property
    def is_serial(self) -> bool:
        """Whether each joint hangs on the one before it, and the tip on the last."""
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
        return bool(self.chain.mass.any() or self.chain.inertia.any())

    def joint(self, name_or_index: str | int) -> int:
        """The 0-based index of a joint.

        Args:
            name_or_index: The joint's name, or its 0-based index, which is returned as it is.

        Raises:
            InputError: There is no such joint; the message names the valid ones and the nearest.
        """
        return joint_index(self.joints, name_or_index, self.name)

    def angles(self, q: Any) -> FloatArray:
        """Joint positions (nv,) from (nv,) positions or from pinocchio's configuration (nq,) [rad or m].

        Args:
            q: Joint positions, (nv,), or pinocchio's configuration, (nq,) [rad or m].

        Raises:
            InputError: The shape is another one, or a number is NaN or infinite.
        """
        return positions_of(self.model, self.continuous, q)

    def configuration(self, q: Any) -> FloatArray:
        """pinocchio's configuration (nq,) from (nv,) positions or (nq,) itself [rad or m].

        Args:
            q: Joint positions, (nv,), or pinocchio's configuration, (nq,) [rad or m].

        Raises:
            InputError: The shape is another one, or a number is NaN or infinite.
        """
        return configuration_of(self.model, self.continuous, self.angles(q))

    def pose(self, q: Any, frame: str | None = None) -> FloatArray:
        """Pose T_WE of the tip, or of another frame, (4, 4) [m].

        Args:
            q: The configuration, (nv,) or (nq,) [rad or m].
            frame: The name of any frame of the model; None is the tip.

        Raises:
            InputError: The shape is another one, a number is NaN or infinite, or there is no such frame.
        """
        data, number = self.model.createData(), self._frame(frame)
        pin.forwardKinematics(self.model, data, self.configuration(q))
        pin.updateFramePlacements(self.model, data)
        return np.array(data.oMf[number].homogeneous)

    def jacobian(self, q: Any, frame: str | None = None) -> FloatArray:
        """J of the tip, v_tip = J v, or of another frame, (6, nv): rows x, y, z, rx, ry, rz, the base's axes.

        The angular rows are in rad: unlike the planner's rows they are not multiplied by ``length``. A joint
        that does not move the frame has a column of zeros, and one that follows another has its own added to
        its leader's.

        Args:
            q: The configuration, (nv,) or (nq,) [rad or m].
            frame: The name of any frame of the model; None is the tip.

        Raises:
            InputError: The shape is another one, a number is NaN or infinite, or there is no such frame.
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
            InputError: The shape is another one, a number is NaN or infinite, or the robot has no masses.
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
            InputError: A shape is another one, a number is NaN or infinite, or the robot has no masses.
        """
        self._needs_masses("bias")
        speed = array("v", v, (self.nv,), "(nv,)")
        data = self.model.createData()
        h = pin.nonLinearEffects(self.model, data, self.configuration(q), speed)
        return coupled_columns(self.chain, np.asarray(h + self.viscous * speed))

    def refuse_tree(self, what: str) -> None:
        """Refuses a robot whose joints are not all on the way to its tip, or follow others, or that floats.

        Args:
            what: What serves serial arms only, the beginning of the sentence, such as ``coverage needs``.

        Raises:
            InputError: The robot is not serial, a joint of it follows another, or its base floats.
        """
        self.refuse_followers(what)
        if not self.is_serial:
            raise InputError(
                f"{what} one serial arm, but {self.name} has joints beside the way to its tip {self.tip!r}; "
                f"take robot.arm_to({self.tip!r}), or that of another frame"
            )
        self.refuse_floating(what)

    def refuse_followers(self, what: str) -> None:
        """Refuses a robot of which a joint follows another one.

        Args:
            what: What serves joints with a motor each only, the beginning of the sentence.

        Raises:
            InputError: A joint follows another one.
        """
        for name, one in followers_of(self.joints, self.chain).items():
            raise InputError(
                f"{what} a motor at every joint, but {name!r} of {self.name} mimics {one.leader!r}; hold "
                f"{name!r} with locked=[{name!r}], or read the robot with a tip before it"
            )

    def refuse_floating(self, what: str) -> None:
        """Refuses a robot whose base floats, for whom it would be held.

        Args:
            what: What serves bases that stand only, the beginning of the sentence.

        Raises:
            InputError: The base floats.
        """
        if self.chain.floating:
            raise InputError(
                f"{what} a base that stands, but {self.name} floats (on_free_base), and nothing there keeps "
                "its momentum; take the robot without that base"
            )

    def _chain(self, model: Any, tip: str) -> Chain:
        return chain_of(model, tip, followers=followers_of(self.joints, self.chain))

    def _frame(self, name: str | None) -> int:
        return frame_id(self.model, self.tip) if name is None else named_frame(self.model, name)

    def _needs_masses(self, what: str) -> None:
        if not self.has_inertia:
            raise InputError(f"{self.name} has no masses, so no {what}; give the model its masses first")

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
        """This robot with some limits replaced, each (nv,) or one number for all; None keeps what there is.

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
        limits, crossed = coupled_limits(self.joints, self.chain, self.limits.replaced(changes))
        model = self.model.copy()
        write_limits(model, limits)
        found = [f for f in self.findings if f.about not in ("limits", "friction", *changes)] + crossed
        found += audit.limit_findings(self.joints, limits, self.continuous)
        found += friction_findings(model, limits)
        audit.refuse_unsafe(self.name, found)
        start = frozen(coupled_places(self.chain, neutral_of(limits, self.neutral)))
        return replace(self, limits=limits, model=model, neutral=start, findings=tuple(found))

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
        if not self.has_inertia:
            raise InputError(f"{self.name} has no masses, so no torques; give the model its masses first")
        rub = [
            now if given is None else one_each(name, given, self.nv)
            for name, given, now in (("viscous", viscous, self.viscous), ("coulomb", coulomb, self.coulomb))
        ]
        model = with_friction(self.model, *rub)
        found = [f for f in self.findings if f.about != "friction"] + friction_findings(model, self.limits)
        audit.refuse_unsafe(self.name, found)
        return replace(self, model=model, chain=self._chain(model, self.tip), findings=tuple(found))

    def with_rotors(self, inertia: Any) -> Self:
        """This robot with other rotors, as joints feel them behind gears: inertia times ratio squared.

        URDF has no field for them, and behind a gear a rotor can be most of what a joint accelerates.

        Args:
            inertia: Rotor inertia, (nv,) or one number for all, >= 0 [kg m2, or kg where a joint slides].

        Raises:
            InputError: A wrong shape, or a robot without masses.
            ModelError: An inertia is negative or not finite.
        """
        if not self.has_inertia:
            raise InputError(f"{self.name} has no masses, so no torques; give the model its masses first")
        model = with_rotors(self.model, one_each("inertia", inertia, self.nv))
        found = [f for f in self.findings if "rotor inertia" not in f.sentence]
        found += rotor_findings(self.joints, model.armature)
        audit.refuse_unsafe(self.name, found)
        return replace(self, model=model, chain=self._chain(model, self.tip), findings=tuple(found))

    def with_payload(self, payload: Payload) -> Self:
        """This robot with a load at its tip, the first of several, beside any that it carries already.

        Args:
            payload: The load, in the frame of the tip.

        Raises:
            InputError: This is no payload, or a robot without masses.
        """
        model = loaded(self.model, self.tip, payload)
        return replace(self, model=model, chain=self._chain(model, self.tip))

    def with_tip(self, T: Any, name: str = "tool") -> Self:
        """This robot with another controlled frame in place of its tip, the first of several.

        Masses, the characteristic length and further tips stay.

        Args:
            T: Pose of the new tip in the frame of the present one, (4, 4) [m].
            name: The name of the new frame.

        Raises:
            InputError: T is no pose, or the name is taken.
        """
        model = with_tip(self.model, self.tip, T, name)
        return replace(self, model=model, chain=self._chain(model, name), tips=(name, *self.tips[1:]))

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
        others = tuple(tip for tip in self.tips if tip != frame)
        return replace(self, chain=self._chain(self.model, frame), tips=(frame, *others))

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
        said = [f for f in self.findings if f.about not in ("limits", "friction", "masses")]
        arm = self.from_pinocchio(self.model, **wishes_of(self, frame))
        return replace(arm, findings=tuple(said), shapes=self.shapes)

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
        if inertial is None and any(f.severity is audit.Severity.UNSAFE for f in dynamics_findings(model)):
            raise InputError(
                f"a base without a mass leaves the joint-space inertia of {self.name} singular, for a joint "
                "turns about the same axis as the base; give inertial=..., the mass of the base"
            )
        return self._on_base(model, base)

    def on_free_base(self, inertial: Inertial) -> Self:
        """This robot on a body that floats in space, such as a satellite: no force holds it, no gravity.

        Six joints come before its own, ``float_x`` to ``float_z`` along the axes of space and ``float_yaw``,
        ``float_pitch``, ``float_roll`` about z, y and x; no motor moves them. A planner moves the others so
        that linear and angular momentum stay 0 and the tip follows its target in space: at the acceleration
        level by M_b a + h_b = 0, at the velocity level by M_b v = 0, the rows of M that belong to the base.
        The whole is at rest at a reset. The pitch is kept within 1.4 rad, for yaw and roll are one at a right
        angle.

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
        whole = self.from_pinocchio(
            model,
            tips=self.tips,
            limits=joined(base, self.limits),
            neutral=np.concatenate([neutral_of(base, None), self.neutral]),
            default_rows=self.default_rows,
            length=self.length,
            mimics={
                name: (one.leader, one.ratio, one.offset)
                for name, one in followers_of(self.joints, self.chain).items()
            },
        )
        said = [f for f in self.findings if f.about not in ("limits", "friction", "masses")]
        said += [f for f in whole.findings if f not in said and not is_about_base(f)]
        return replace(whole, findings=tuple(said), shapes=carried(self.shapes, whole.joints[len(base) - 1]))

    def to_urdf(self) -> str:
        """This robot as the text of a URDF, which ``from_urdf`` reads back to rounding.

        A link stands behind each joint, with its inertia and with cylinders to look at; the joint turns about
        or slides along its own z axis, and fixed joints end in the tips. A turning joint without end stops
        becomes a ``continuous`` one. Readers of URDF sort joints that hang on one link by name, so those of
        several arms may come back in another order. Limits of acceleration and jerk are written as in URDF
        1.2, those of acceleration and rotor inertias as Drake's extensions, too; older tools skip them.
        Gravity, ``neutral``, ``default_rows`` and ``length`` are no part of a URDF: hand them to
        ``from_urdf``.

        Raises:
            InputError: A name cannot stand in XML.
        """
        return urdf_text(self.name, self.model, self.tips, self.chain, self.limits)
