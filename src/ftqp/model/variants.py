"""The robots that a robot may become: with other limits, friction, rotors, load, tip or base."""

from dataclasses import replace
from typing import Any, Self

import numpy as np

from ftqp.core.checks import FloatArray, frozen, instance
from ftqp.core.errors import InputError
from ftqp.model import audit
from ftqp.model.arm_on_way import wishes_of
from ftqp.model.audit import Finding, rotor_findings
from ftqp.model.build import write_limits
from ftqp.model.chain import Chain, chain_of
from ftqp.model.embodied import Embodied, Shapes, carried
from ftqp.model.followers import coupled_limits, coupled_places, followers_of
from ftqp.model.grafting import base_limits, free_base, free_base_limits, is_about_base, planar_base
from ftqp.model.limits import JointLimits, joined, one_each
from ftqp.model.payload import Payload
from ftqp.model.readers import Readers
from ftqp.model.reduction import named_frame
from ftqp.model.refitting import friction_findings, loaded, with_friction, with_rotors, with_tip
from ftqp.model.serial import Inertial
from ftqp.model.shape import dynamics_findings, neutral_of


class Variants(Embodied, Readers):
    """The methods of a ``Robot`` that give another one, for none is ever changed."""

    __slots__ = ()
    name: str
    model: Any
    tips: tuple[str, ...]
    chain: Chain
    limits: JointLimits
    neutral: FloatArray
    default_rows: tuple[str, ...]
    length: float
    findings: tuple[Finding, ...]
    shapes: Shapes

    def _with(self, **changes: Any) -> Self:
        return replace(self, **changes)  # type: ignore[type-var]  # every robot is a dataclass

    def _chain(self, model: Any, tip: str) -> Chain:
        return chain_of(model, tip, followers=followers_of(self.chain.names, self.chain))

    def _needs_masses(self, what: str) -> None:
        if not self.chain.has_inertia:
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
        names = self.chain.names
        limits, crossed = coupled_limits(names, self.chain, self.limits.replaced(changes, names))
        model = self.model.copy()
        write_limits(model, limits)
        found = [f for f in self.findings if f.about not in ("limits", "friction", *changes)] + crossed
        found += audit.widened(
            names, [{key: getattr(self.limits, key)[i] for key in given} for i in range(len(names))], changes
        )
        found += audit.limit_findings(names, limits, self.chain.continuous, self.chain.prismatic)
        found += friction_findings(model, limits)
        audit.refuse_unsafe(self.name, found)
        start = frozen(coupled_places(self.chain, neutral_of(limits, self.neutral)))
        return self._with(limits=limits, model=model, neutral=start, findings=tuple(found))

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
        rub = [
            now if given is None else one_each(name, given, len(self.chain.names))
            for name, given, now in (
                ("viscous", viscous, self.chain.viscous),
                ("coulomb", coulomb, self.chain.coulomb),
            )
        ]
        model = with_friction(self.model, *rub)
        found = [f for f in self.findings if f.about != "friction"] + friction_findings(model, self.limits)
        audit.refuse_unsafe(self.name, found)
        return self._with(model=model, chain=self._chain(model, self.tips[0]), findings=tuple(found))

    def with_rotors(self, inertia: Any) -> Self:
        """This robot with other rotors, as joints feel them behind gears: inertia times ratio squared.

        URDF has no field for them, and behind a gear a rotor can be most of what a joint accelerates.

        Args:
            inertia: Rotor inertia, (nv,) or one number for all, >= 0 [kg m2, or kg where a joint slides].

        Raises:
            InputError: A wrong shape, or a robot without masses.
            ModelError: An inertia is negative or not finite.
        """
        self._needs_masses("torques")
        model = with_rotors(self.model, one_each("inertia", inertia, len(self.chain.names)))
        found = [f for f in self.findings if "rotor inertia" not in f.sentence]
        found += rotor_findings(self.chain.names, model.armature)
        audit.refuse_unsafe(self.name, found)
        return self._with(model=model, chain=self._chain(model, self.tips[0]), findings=tuple(found))

    def with_payload(self, payload: Payload) -> Self:
        """This robot with a load at its tip, the first of several, beside any that it carries already.

        Args:
            payload: The load, in the frame of the tip.

        Raises:
            InputError: This is no payload, or a robot without masses.
        """
        model = loaded(self.model, self.tips[0], payload)
        return self._with(model=model, chain=self._chain(model, self.tips[0]))

    def with_tip(self, T: Any, name: str = "tool") -> Self:
        """This robot with another controlled frame in place of its tip, the first of several.

        Masses, the characteristic length and further tips stay.

        Args:
            T: Pose of the new tip in the frame of the present one, (4, 4) [m].
            name: The name of the new frame.

        Raises:
            InputError: T is no pose, or the name is taken.
        """
        model = with_tip(self.model, self.tips[0], T, name)
        return self._with(model=model, chain=self._chain(model, name), tips=(name, *self.tips[1:]))

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
        return self._with(chain=self._chain(self.model, frame), tips=(frame, *others))

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
        return arm._with(findings=tuple(said), shapes=self.shapes)

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
                for name, one in followers_of(self.chain.names, self.chain).items()
            },
        )
        said = [f for f in self.findings if f.about not in ("limits", "friction", "masses")]
        said += [f for f in whole.findings if f not in said and not is_about_base(f)]
        return whole._with(
            findings=tuple(said), shapes=carried(self.shapes, whole.chain.names[len(base) - 1])
        )
