"""Planar arms of any number of links."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ftqp.core.errors import InputError
from ftqp.kernel.layout.enums import JOINTS
from ftqp.model.catalog.arm import arm
from ftqp.model.robot import Robot
from ftqp.model.serial import Inertial, placement

LONGEST = 1e6
"""A link of a made-up arm is no longer [m]."""
REACH = 1.5
"""Length of the stretched arm [m]."""

DENSITY = 4.0
"""Mass per length of the uniform slender links [kg/m]."""

FLAT = (0.0, 0.0, 0.0)
DOWN = (0.0, -9.81, 0.0)
"""Gravity [m/s2] of an arm in a horizontal plane, and in a vertical one."""


BEND = float(np.deg2rad(150.0))
"""How far a joint with limits turns either way [rad]."""

COUNT = 4
"""Joints of an arm for which nothing is said."""


def planar(
    *,
    count: int | None = None,
    lengths: Sequence[float] | None = None,
    continuous: bool = False,
    vertical: bool = False,
) -> Robot:
    """Planar arm of slender links, moving in the x-y plane of the base.

    Source: none, a made-up arm for studies of redundancy: 4 kg/m, 150 degrees either way, 1 rad/s, 5 rad/s2.

    Args:
        count: The number of joints, 1 to 64; without it and without lengths 4. The links are equal and 1.5 m
            long in all: more joints are shorter and leave more redundancy.
        lengths: The lengths of the links instead of their number, (n,), each > 0 [m]; longer is heavier.
        continuous: Whether the joints turn without end; without it they turn 150 degrees either way.
        vertical: Whether gravity is (0, -9.81, 0) m/s2; without it the arm moves in a horizontal plane.
    """
    sizes = _lengths(count, lengths)
    limits: dict[str, Any] = dict(v_max=1.0) if continuous else dict(q_min=-BEND, q_max=BEND, v_max=1.0)
    start = np.full(len(sizes), np.pi / (2.0 * len(sizes)))
    own = lengths is not None
    name = f"planar({', '.join(f'{size:g}' for size in sizes)})" if own else f"planar({len(sizes)})"
    return links(name, sizes, DENSITY, limits, neutral=start, vertical=vertical, continuous=bool(continuous))


def _lengths(count: Any, lengths: Any) -> list[float]:
    """The lengths of the links [m]."""
    if lengths is None:
        number = COUNT if count is None else count
        if isinstance(number, bool) or not isinstance(number, int) or not 1 <= number <= JOINTS:
            raise InputError(f"count is {count!r}, expected a number of joints from 1 to {JOINTS}")
        return [REACH / number] * number
    if count is not None:
        raise InputError(f"count is {count!r} beside lengths, which already say it; leave one of them out")
    try:
        sizes = np.atleast_1d(np.asarray(lengths, dtype=np.float64))
    except (TypeError, ValueError, OverflowError):
        sizes = np.empty(0)
    if sizes.ndim != 1 or not 1 <= sizes.size <= JOINTS or not ((sizes > 0.0) & (sizes <= LONGEST)).all():
        raise InputError(
            f"lengths is {lengths!r:.80}, expected 1 to {JOINTS} positive numbers up to {LONGEST:g} [m]"
        )
    return [float(size) for size in sizes]


def links(
    name: str,
    lengths: Sequence[float],
    density: float,
    limits: Mapping[str, Any],
    *,
    neutral: Any,
    vertical: bool,
    continuous: bool = False,
) -> Robot:
    """Planar arm of uniform slender links: m = density l, centre of mass at l/2, I_zz = m l^2 / 12.

    Links are (n,) long [m] and of ``density`` [kg/m].
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
        continuous=continuous,
    )
