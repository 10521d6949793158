"""Planar arms of any number of links."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ftqp.core.errors import InputError
from ftqp.kernel.layout.enums import JOINTS
from ftqp.model.catalog.arm import arm
from ftqp.model.robot import Robot
from ftqp.model.serial import Inertial, placement

REACH = 1.5
"""Length of the stretched arm [m]."""

DENSITY = 4.0
"""Mass per length of the uniform slender links [kg/m]."""

FLAT = (0.0, 0.0, 0.0)
DOWN = (0.0, -9.81, 0.0)
"""Gravity [m/s2] of an arm in a horizontal plane, and in a vertical one."""


def planar(*, count: int = 4, vertical: bool = False) -> Robot:
    """Planar arm of ``count`` equal slender links, 1.5 m long in all, moving in the x-y plane of the base.

    Source: none, a made-up arm for studies of redundancy: 4 kg/m, 150 degrees either way, 1 rad/s, 5 rad/s2.

    Args:
        count: The number of joints, 1 to 32. More joints are shorter and leave more redundancy.
        vertical: Whether gravity is (0, -9.81, 0) m/s2; without it the arm moves in a horizontal plane.

    Raises:
        InputError: ``count`` is not a whole number from 1 to 32.
    """
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= JOINTS:
        raise InputError(f"count is {count!r}, expected a number of joints from 1 to {JOINTS}")
    bend = np.deg2rad(150.0)
    limits = dict(q_min=-bend, q_max=bend, v_max=1.0)
    start = np.full(count, np.pi / (2.0 * count))
    lengths = [REACH / count] * count
    return links(f"planar({count})", lengths, DENSITY, limits, neutral=start, vertical=vertical)


def links(
    name: str,
    lengths: Sequence[float],
    density: float,
    limits: Mapping[str, Any],
    *,
    neutral: Any,
    vertical: bool,
) -> Robot:
    """Planar arm of uniform slender links: m = density l, centre of mass at l/2, I_zz = m l^2 / 12.

    Args:
        name: The robot's name.
        lengths: Lengths of the links, (n,) [m].
        density: Mass per length [kg/m].
        limits: Fields of ``JointLimits``, each (n,) or one number.
        neutral: a configuration inside the limits, (n,) [rad].
        vertical: Gravity (0, -9.81, 0) m/s2 instead of zero.
    """
    masses = [
        Inertial(
            mass=density * length,
            com=np.array([length / 2, 0.0, 0.0]),
            inertia=np.diag([0.0, 1.0, 1.0]) * (density * length**3 / 12.0),
        )
        for length in lengths
    ]
    steps = [0.0, *lengths[:-1]]
    rows = ("x", "y") if len(lengths) > 1 else ("x",)
    return arm(
        name,
        [f"j{i + 1}" for i in range(len(lengths))],
        [placement((step, 0.0, 0.0)) for step in steps],
        masses,
        limits,
        tip="tip",
        tip_pose=placement((lengths[-1], 0.0, 0.0)),
        neutral=neutral,
        default_rows=rows,
        gravity=DOWN if vertical else FLAT,
    )
