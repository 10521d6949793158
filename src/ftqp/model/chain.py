"""The constants of a chain or a tree, all that the kernel knows of a robot; its bare geometry for logs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np
import pinocchio as pin

from ftqp.core.checks import BoolArray, FloatArray, IntArray, array, numbers, read_only
from ftqp.core.errors import InputError, ModelError
from ftqp.core.pose import rotation_to, transform
from ftqp.kernel.layout.enums import JOINTS
from ftqp.model.followers import Follower, is_led, leads_of

ALIGNED = {
    "X": np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    "Y": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "Z": np.eye(3),
}
"""Rotations whose third column is the x, y or z axis: they turn a joint to its own z axis."""

FREE_BASE = ("float_x", "float_y", "float_z", "float_yaw", "float_pitch", "float_roll")
"""The joints that ``Robot.on_free_base`` puts before those of a robot; no motor moves them."""
UNIT = 1e-9
"""Largest deviation from one of the length of an axis."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chain:
    """Constants of an arm, or of a tree of arms on one base, every joint turned to its own z axis.

    T_i = T_parent (rotation_i, translation_i) Rz(q_i), or Tz(q_i) for a prismatic joint. The parent of joint
    i of a serial arm is joint i-1.
    """

    names: tuple[str, ...]  # Joint names, base to tips
    parent: IntArray  # The joint that each hangs on, lower than itself; -1 is the base, (nv,)
    tip_joint: int  # The joint that the tip moves with
    floating: int  # How many joints from the first on have no motor, those of a base that floats: 6 or 0
    prismatic: BoolArray  # Whether the joint slides, (nv,)
    # Whether the joint turns without limits and pinocchio stores it as (cos, sin), (nv,)
    continuous: BoolArray
    rotation: FloatArray  # Orientation of joint frame i in that of its parent at q = 0, (nv, 3, 3)
    translation: FloatArray  # Origin of joint frame i in that of its parent at q = 0, (nv, 3) [m]
    mass: FloatArray  # Mass of the body behind each joint, held joints' bodies lumped in, (nv,) [kg]
    com: FloatArray  # Its centre of mass in the joint's frame, (nv, 3) [m]
    inertia: FloatArray  # Its inertia about the centre of mass, axes of the joint's frame, (nv, 3, 3) [kg m2]
    armature: FloatArray  # Rotor inertia seen at the joint, on the diagonal of M, (nv,) [kg m2 or kg]
    viscous: FloatArray  # Viscous friction, a part of h, (nv,) [N m s/rad or N s/m]
    # Coulomb friction, (nv,) [N m or N]. The planner's torques leave it out: to feed forward a friction whose
    # sign flips at rest makes an arm hunt.
    coulomb: FloatArray
    tip_rotation: FloatArray  # Orientation of the tip in the frame of its joint, (3, 3)
    tip_translation: FloatArray  # Origin of the tip in the frame of its joint, (3,) [m]
    gravity: FloatArray  # Gravity in the base frame, (3,) [m/s2]
    # The joint that each follows, as a file's ``mimic`` has it, itself where it follows none, (nv,)
    lead: IntArray
    ratio: FloatArray  # Of its motion to that of its leader, 1 where it follows none, (nv,)
    offset: FloatArray  # Where it is when its leader is at 0, (nv,) [rad or m]

    def __post_init__(self) -> None:
        read_only(self)

    @property
    def is_serial(self) -> bool:
        """Whether each joint hangs on the one before it and the tip on the last, and none follows another."""
        n = len(self.names)
        in_line = bool((self.parent == np.arange(-1, n - 1)).all()) and self.tip_joint == n - 1
        return in_line and not self.has_followers

    @property
    def has_inertia(self) -> bool:
        """Whether any link has a mass or an inertia."""
        return bool(self.mass.any() or self.inertia.any())

    @property
    def has_followers(self) -> bool:
        """Whether a joint follows another one."""
        return bool(is_led(self).any())

    def way(self, joint: int) -> list[int]:
        """The joints that move the body behind a joint, base first, itself last; none for -1, the base."""
        found: list[int] = []
        while joint >= 0:
            found.append(joint)
            joint = int(self.parent[joint])
        return found[::-1]

    @property
    def limbs(self) -> list[list[int]]:
        """How the arm is drawn, see ``limbs_of``."""
        return limbs_of(self.parent, self.tip_joint)

    def constants(self) -> dict[str, Any]:
        """Everything but the names, by the argument names of ``ftqp.kernel.layout.record.load_chain``."""
        return {field.name: getattr(self, field.name) for field in fields(self) if field.name != "names"}


def limbs_of(parent: IntArray, tip_joint: int) -> list[list[int]]:
    """The lines along which an arm is drawn, rows of places from 0 on, each from where it leaves one."""
    n = len(parent)
    above = [0, *(int(i) + 1 for i in parent), tip_joint + 1]
    seen, found = {0}, []
    for end in [n + 1, *(i for i in range(1, n + 1) if i not in above[1:])]:
        line = [end]
        while line[-1] not in seen:
            seen.add(line[-1])
            line.append(above[line[-1]])
        found.append(line[::-1])
    return found


def chain_of(model: Any, tip: str, *others: str, followers: Mapping[str, Follower] | None = None) -> Chain:
    """The constants of a pinocchio model, all its joints included, with the frame ``tip`` and others."""
    frame = model.frames[frame_id(model, tip)]
    ids = range(1, model.njoints)
    findings = [reason for i in ids if (reason := unsupported(model.joints[i], model.names[i]))]
    if not 1 <= len(ids) <= JOINTS:
        hold = "; hold others with locked=[...] or name fewer tips" if len(ids) > JOINTS else ""
        findings.append(f"{len(ids)} joints move; expected 1 to {JOINTS}{hold}")
    for name in (tip, *others):
        if model.frames[frame_id(model, name)].parentJoint == 0:
            findings.append(f"no joint moves {name!r}")
    if findings:
        raise ModelError(f"{model.name} is not a robot that the kernel can express", findings)

    turns = [pin.SE3.Identity()]
    turns += [pin.SE3(axis_rotation(model.joints[i]), np.zeros(3)) for i in ids]
    placements = [turns[model.parents[i]].inverse() * model.jointPlacements[i] * turns[i] for i in ids]
    bodies = [turns[i].actInv(model.inertias[i]) for i in ids]
    _, tip_rotation, tip_translation = ends_of(model, [tip])[0]
    kinds = [kind(model.joints[i]) for i in ids]
    names = tuple(str(model.names[i]) for i in ids)
    lead, ratio, offset = leads_of(names, followers or {})
    return Chain(
        names=names,
        parent=np.array([model.parents[i] - 1 for i in ids]),
        tip_joint=int(frame.parentJoint) - 1,
        floating=6 if tuple(model.names[1:7]) == FREE_BASE else 0,
        prismatic=np.array([k.startswith("P") for k in kinds]),
        continuous=np.array([model.joints[i].nq == 2 for i in ids]),
        rotation=np.array([p.rotation for p in placements]),
        translation=np.array([p.translation for p in placements]),
        mass=np.array([b.mass for b in bodies]),
        com=np.array([b.lever for b in bodies]),
        inertia=np.array([b.inertia for b in bodies]),
        armature=np.array([model.armature[model.idx_vs[i]] for i in ids]),
        viscous=np.array([model.damping[model.idx_vs[i]] for i in ids]),
        coulomb=np.array([model.friction[model.idx_vs[i]] for i in ids]),
        tip_rotation=tip_rotation,
        tip_translation=tip_translation,
        gravity=np.array(model.gravity.linear),
        lead=lead,
        ratio=ratio,
        offset=offset,
    )


def ends_of(model: Any, tips: Sequence[str]) -> list[tuple[int, FloatArray, FloatArray]]:
    """The joint of each tip, and the tip's orientation (3, 3) and origin (3,) [m] in that joint's frame."""
    found = []
    for tip in tips:
        frame = model.frames[frame_id(model, tip)]
        turn = pin.SE3(axis_rotation(model.joints[frame.parentJoint]), np.zeros(3))
        end = turn.inverse() * frame.placement
        found.append((int(frame.parentJoint) - 1, np.array(end.rotation), np.array(end.translation)))
    return found


def kind(joint: Any) -> str:
    """pinocchio's name of a joint's type without the prefix, for example ``RZ`` or ``RevoluteUnaligned``."""
    return str(joint.shortname()).removeprefix("JointModel").removesuffix("Tpl")


def unsupported(joint: Any, name: str) -> str:
    """Why the kernel cannot express a joint, or an empty string."""
    known = kind(joint)
    simple = known[:-1] in ("R", "P", "RUB") and known[-1] in ALIGNED
    if simple:
        return ""
    if known in ("RevoluteUnaligned", "PrismaticUnaligned", "RevoluteUnboundedUnaligned"):
        return (
            "" if abs(np.linalg.norm(slanted_axis(joint)) - 1.0) < UNIT else f"joint {name!r} has a zero axis"
        )
    return (
        f"joint {name!r} is of type {known}; expected revolute, prismatic or continuous joints; "
        f"hold it with locked=[{name!r}] or split it into simple joints"
    )


def axis_rotation(joint: Any) -> FloatArray:
    """A rotation (3, 3) whose third column is the joint's axis."""
    known = kind(joint)
    if known[-1] in ALIGNED:
        return ALIGNED[known[-1]]
    return rotation_to(slanted_axis(joint))


def slanted_axis(joint: Any) -> FloatArray:
    """The axis, (3,), of a joint along none of x, y, z: from its motion subspace, which every type has."""
    data = joint.createData()
    joint.calc(data, np.array([1.0, 0.0]) if joint.nq == 2 else np.zeros(1))
    twist = np.asarray(data.S, dtype=np.float64).reshape(6)
    return twist[:3] if kind(joint).startswith("P") else twist[3:]


def frame_id(model: Any, tip: str) -> int:
    """The index of the frame ``tip``; of several with that name bodies come first, then operational ones."""
    kinds = [pin.FrameType.BODY, pin.FrameType.OP_FRAME, pin.FrameType.FIXED_JOINT, pin.FrameType.JOINT]
    for one in kinds:
        index = int(model.getFrameId(tip, one))
        if index < model.nframes:
            return index
    raise ModelError(f"{tip!r} is not a frame of {model.name}")


def positions_of(model: Any, continuous: BoolArray, q: Any) -> FloatArray:
    """Joint positions (nv,) from (nv,) positions or from pinocchio's configuration (nq,) [rad or m]."""
    nv, given = len(continuous), numbers("q", q)
    if model.nq == nv or given.shape == (nv,):
        return array("q", given, (nv,), "(nv,)")
    configuration = array("q", given, (int(model.nq),), "(nv,) or (nq,)")
    result = np.empty(nv)
    for i, at in enumerate(model.idx_qs[1:]):
        if continuous[i]:
            result[i] = np.arctan2(configuration[at + 1], configuration[at])
        else:
            result[i] = configuration[at]
    return result


def configuration_of(model: Any, continuous: BoolArray, positions: FloatArray) -> FloatArray:
    """pinocchio's configuration (nq,) from joint positions (nv,) [rad or m]."""
    result = np.empty(int(model.nq))
    for i, at in enumerate(model.idx_qs[1:]):
        if continuous[i]:
            result[at : at + 2] = np.cos(positions[i]), np.sin(positions[i])
        else:
            result[at] = positions[i]
    return result


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Skeleton:
    """Where the joints of an arm, or of several on one base, sit on each other."""

    prismatic: BoolArray  # Whether the joint slides, (nv,)
    # Each joint's frame in that of its parent at q = 0, its z axis along the joint, (nv, 4, 4)
    placements: FloatArray
    tip: FloatArray  # The tip in the frame of its joint, (4, 4)
    parent: IntArray  # The joint that each hangs on, lower than itself; -1 is the base, (nv,)
    tip_joint: int  # The joint that the tip moves with

    @classmethod
    def of(cls, chain: Chain) -> Self:
        """The skeleton of a chain."""
        placements = np.array(
            [transform(R, p) for R, p in zip(chain.rotation, chain.translation, strict=True)]
        )
        return cls(
            prismatic=chain.prismatic,
            placements=placements,
            tip=transform(chain.tip_rotation, chain.tip_translation),
            parent=chain.parent,
            tip_joint=chain.tip_joint,
        )

    @classmethod
    def from_facts(cls, facts: Mapping[str, Any]) -> Self:
        """The skeleton that ``facts`` gave, for example those in a log; without parents it is serial."""
        try:
            prismatic = np.array(facts["prismatic"], dtype=np.bool_)
            n = len(prismatic)
            placements = np.array(facts["placements"], dtype=np.float64).reshape(n, 4, 4)
            tip = np.array(facts["tip"], dtype=np.float64).reshape(4, 4)
            parent = np.array(facts.get("parent", range(-1, n - 1)), dtype=np.int64).reshape(n)
            tip_joint = int(facts.get("tip_joint", n - 1))
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"the arm's geometry is not readable: {error!s:.100}") from error
        return cls(prismatic=prismatic, placements=placements, tip=tip, parent=parent, tip_joint=tip_joint)

    def facts(self) -> dict[str, Any]:
        """The same in values that JSON can hold; parents only where the arm is not serial."""
        n = len(self.prismatic)
        serial = (self.parent == np.arange(-1, n - 1)).all() and self.tip_joint == n - 1
        return {
            "prismatic": self.prismatic.tolist(),
            "placements": self.placements.tolist(),
            "tip": self.tip.tolist(),
        } | ({} if serial else {"parent": self.parent.tolist(), "tip_joint": self.tip_joint})

    @property
    def limbs(self) -> list[list[int]]:
        """How the arm is drawn, see ``ftqp.model.chain.limbs_of``."""
        return limbs_of(self.parent, self.tip_joint)

    def frames(self, q: FloatArray) -> FloatArray:
        """Poses of the joint frames and then of the tip in the base, (K, nv + 1, 4, 4)."""
        model = pin.Model()
        for i, (placement, slides) in enumerate(zip(self.placements, self.prismatic, strict=True)):
            joint = pin.JointModelPZ() if slides else pin.JointModelRZ()
            model.addJoint(int(self.parent[i]) + 1, joint, pin.SE3(placement), f"j{i}")
        data, tip = model.createData(), pin.SE3(self.tip)
        poses = np.empty((len(q), model.njoints, 4, 4))
        for k, row in enumerate(np.asarray(q, dtype=np.float64)):
            pin.forwardKinematics(model, data, row)
            for i in range(1, model.njoints):
                poses[k, i - 1] = data.oMi[i].homogeneous
            poses[k, -1] = (data.oMi[self.tip_joint + 1] * tip).homogeneous
        return poses
