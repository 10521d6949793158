"""The catalog: arms from published figures, a file each, without any downloaded file."""

from inspect import signature
from re import fullmatch
from typing import TYPE_CHECKING, Any

from ftqp.core.errors import InputError, unknown

if TYPE_CHECKING:
    from ftqp.model.robot import Robot

CATALOG = {
    "canadarm2": "Canadarm2 of the space station, 7 joints, 17 m (Nguyen and Hughes 1994), kinematics only",
    "dual_panda": "two Pandas next to each other on one base, 14 joints, two tips, with masses",
    "iiwa14": "KUKA LBR iiwa 14 R820, 7 joints, with masses",
    "modular11": "hyper-redundant arm of 11 alternating rolls and pitches (Bedrossian 1993), kinematics only",
    "panda": "Franka Emika Panda with its hand, 7 joints, with masses",
    "planar": "planar arm of n equal links, planar(n), with masses",
    "planar6": "planar arm of 6 links, a motor joint and 5 push-rod joints (Jin et al. 2017), with masses",
    "puma560": "Unimation PUMA 560, 6 joints, kinematics only",
    "srs7": "7 joints, spherical shoulder and wrist, kinematics only",
    "xarm7": "UFACTORY xArm 7, 7 joints, with masses",
    "zhang7": "7 joints of the space-manipulator kind (Zhang et al.), kinematics only",
}
"""Robots by name, each of a file or a function of the same name, and what they are."""


def names() -> list[str]:
    """Names that ``load`` knows."""
    return list(CATALOG)


def load(name: str, **options: Any) -> "Robot":
    """A robot of the catalog.

    Args:
        name: The robot's name; ``planar(8)`` is short for ``load("planar", count=8)``.
        options: Keyword arguments of that robot's function, for example ``hand=False`` of ``panda``.

    Raises:
        InputError: The robot, or an option of it, is unknown; the message names the valid ones.
    """
    short = fullmatch(r"planar\((\d{1,3})\)", name) if isinstance(name, str) else None
    if short:
        name, options = "planar", {"count": int(short[1]), **options}
    if name not in CATALOG:
        remedy = "others are read by ftqp.Robot.from_urdf(file, tip=...)"
        raise unknown("robot", name, "the catalog", names(), remedy)
    from ftqp.model.catalog.arms import WITH_OPTIONS, arm_of_file  # pinocchio takes a while to load

    build = WITH_OPTIONS.get(name, lambda: arm_of_file(name))
    valid = list(signature(build).parameters)
    for option in options:
        if option not in valid:
            expected = ", ".join(valid) or "no options"
            raise InputError(f"{option!r} is not an option of the robot {name}; it has {expected}")
    return build(**options)
