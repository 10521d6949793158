"""A robot: joints, limits and tips of an arm or of a tree of arms, immutable and audited."""

from dataclasses import dataclass
from importlib import import_module
from typing import Any, cast, final

import numpy as np
import pinocchio as pin

from ftqp.core.checks import BoolArray, FloatArray, array
from ftqp.core.errors import InputError
from ftqp.core.picture import Picture
from ftqp.model.audit import UNKNOWN_TORQUE, Finding
from ftqp.model.chain import Chain, configuration_of, frame_id, positions_of
from ftqp.model.embodied import Shapes
from ftqp.model.followers import (
    coupled_columns,
    coupled_square,
    followers_of,
)
from ftqp.model.limits import JointLimits
from ftqp.model.reduction import joint_index, named_frame
from ftqp.model.robot_table import robot_html
from ftqp.model.urdf_text import urdf_text
from ftqp.model.variants import Variants


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False, weakref_slot=True)
class Robot(Variants):
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

    def refuse_unknown_torques(self, what: str) -> None:
        """Refuses a robot whose file has a torque limit of 0, or none, for every joint that has a motor.

        Args:
            what: What would use torques, the beginning of the sentence.

        Raises:
            InputError: Nobody has said since what the motors can give.
        """
        if any(finding.about == UNKNOWN_TORQUE for finding in self.findings):
            raise InputError(
                f"{what}, and the file of {self.name} has no torque limits (effort 0 or missing); give them "
                "by robot.with_limits(tau_max=...), inf where a motor has none"
            )

    def _frame(self, name: str | None) -> int:
        return frame_id(self.model, self.tip) if name is None else named_frame(self.model, name)

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
