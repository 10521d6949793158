"""A serial arm as URDF text, so that every program of a comparison reads the same robot."""

from dataclasses import dataclass
from typing import Any, Self
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TIP = "tip"
"""Name of the link whose frame is the tip; it has no mass."""

GIMBAL = 1e-9
"""Below this cosine of the pitch, roll and yaw turn about one axis and yaw is taken as zero."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Arm:
    """What a URDF says of a serial arm whose joints all turn about, or slide along, their own z axis.

    Attributes:
        names: Joint names from base to tip, (nv,).
        prismatic: Which joints slide, (nv,).
        rotation: Orientation of each joint frame in the one before at q = 0, (nv, 3, 3).
        translation: Origin of each joint frame in the one before, (nv, 3) [m].
        mass: Mass moved by each joint alone, (nv,) [kg].
        com: Its centre in the joint's frame, (nv, 3) [m].
        inertia: Its inertia about that centre along the joint's axes, (nv, 3, 3) [kg m2].
        tip_rotation: Orientation of the tip in the last joint's frame, (3, 3).
        tip_translation: Origin of the tip in the last joint's frame, (3,) [m].
        q_min: Least position, (nv,) [rad or m]; infinite on a joint that turns without end.
        q_max: Greatest position, (nv,) [rad or m].
        v_max: Velocity limit, (nv,) [rad/s or m/s].
        a_max: Acceleration limit, (nv,) [rad/s2 or m/s2]; a URDF has no place for it.
        tau_max: Torque or force limit, (nv,) [N m or N].
        neutral: a configuration inside the limits, (nv,).
    """

    names: tuple[str, ...]
    prismatic: NDArray[np.bool_]
    rotation: Array
    translation: Array
    mass: Array
    com: Array
    inertia: Array
    tip_rotation: Array
    tip_translation: Array
    q_min: Array
    q_max: Array
    v_max: Array
    a_max: Array
    tau_max: Array
    neutral: Array

    @classmethod
    def of(cls, robot: Any) -> Self:
        """The arm of an ``ftqp.Robot``."""
        chain, limits = robot.chain, robot.limits
        return cls(
            names=tuple(chain.names),
            prismatic=chain.prismatic,
            rotation=chain.rotation,
            translation=chain.translation,
            mass=chain.mass,
            com=chain.com,
            inertia=chain.inertia,
            tip_rotation=chain.tip_rotation,
            tip_translation=chain.tip_translation,
            q_min=limits.q_min,
            q_max=limits.q_max,
            v_max=limits.v_max,
            a_max=limits.a_max,
            tau_max=limits.tau_max,
            neutral=robot.neutral,
        )


def text(name: str, arm: Arm) -> str:
    """URDF of ``arm``: links ``base``, ``link_<joint>``, ``tip``, with inertials and limits, no shapes."""
    if not (np.isfinite(arm.v_max).all() and np.isfinite(arm.tau_max).all()):
        raise ValueError(f"{name} has an infinite velocity or torque limit, expected finite ones; set them")
    lines = [f"<robot name={quoteattr(name)}>", '  <link name="base"/>']
    parent = "base"
    for i, joint in enumerate(arm.names):
        link = f"link_{joint}"
        lines += _link(link, arm.mass[i], arm.com[i], arm.inertia[i])
        lines += _joint(joint, parent, link, arm, i)
        parent = link
    lines += [
        f'  <link name="{TIP}"/>',
        f'  <joint name="{TIP}_mount" type="fixed">',
        f'    <parent link={quoteattr(parent)}/><child link="{TIP}"/>',
        f"    {_origin(arm.tip_rotation, arm.tip_translation)}",
        "  </joint>",
        "</robot>",
    ]
    return "\n".join(lines) + "\n"


def roll_pitch_yaw(rotation: Array) -> Array:
    """Angles (3,) [rad] with rotation = Rz(yaw) Ry(pitch) Rx(roll), the convention of URDF."""
    cosine = float(np.hypot(rotation[0, 0], rotation[1, 0]))
    pitch = np.arctan2(-rotation[2, 0], cosine)
    if cosine < GIMBAL:
        return np.array([np.arctan2(-rotation[1, 2], rotation[1, 1]), pitch, 0.0])
    roll = np.arctan2(rotation[2, 1], rotation[2, 2])
    return np.array([roll, pitch, np.arctan2(rotation[1, 0], rotation[0, 0])])


def _link(name: str, mass: float, com: Array, inertia: Array) -> list[str]:
    parts = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    entries = " ".join(f'{key}="{float(inertia[at])!r}"' for key, at in parts.items())
    return [
        f"  <link name={quoteattr(name)}>",
        "    <inertial>",
        f'      <origin xyz="{_numbers(com)}" rpy="0 0 0"/>',
        f'      <mass value="{float(mass)!r}"/><inertia {entries}/>',
        "    </inertial>",
        "  </link>",
    ]


def _joint(name: str, parent: str, child: str, arm: Arm, i: int) -> list[str]:
    limit = f'effort="{float(arm.tau_max[i])!r}" velocity="{float(arm.v_max[i])!r}"'
    kind = "prismatic" if arm.prismatic[i] else "revolute"
    if np.isfinite(arm.q_min[i]) and np.isfinite(arm.q_max[i]):
        limit = f'lower="{float(arm.q_min[i])!r}" upper="{float(arm.q_max[i])!r}" {limit}'
    elif arm.prismatic[i]:
        raise ValueError(f"{name} slides without end, expected position limits; set them")
    else:
        kind = "continuous"
    return [
        f'  <joint name={quoteattr(name)} type="{kind}">',
        f"    <parent link={quoteattr(parent)}/><child link={quoteattr(child)}/>",
        f"    {_origin(arm.rotation[i], arm.translation[i])}",
        '    <axis xyz="0 0 1"/>',
        f"    <limit {limit}/>",
        "  </joint>",
    ]


def _origin(rotation: Array, translation: Array) -> str:
    return f'<origin xyz="{_numbers(translation)}" rpy="{_numbers(roll_pitch_yaw(rotation))}"/>'


def _numbers(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)
