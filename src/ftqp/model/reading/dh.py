"""Arms from tables of Denavit-Hartenberg parameters."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, array
from ftqp.core.errors import InputError, unknown
from ftqp.core.pose import pose as checked_pose
from ftqp.core.pose import rotation_x, rotation_z, transform
from ftqp.model.limits import JointLimits
from ftqp.model.serial import EARTH, Body, Inertial, serial_model

TIP = "tip"
"""Name of the tip frame of an arm from a table."""


def model(
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
) -> Any:
    """A pinocchio model of the arm of a table.

    standard:  T_{i-1,i} = Rz(theta_i + q_i) Tz(d_i) Tx(a_i) Rx(alpha_i)
    modified:  T_{i-1,i} = Rx(alpha_i) Tx(a_i) Rz(theta_i + q_i) Tz(d_i), row i holding alpha_{i-1}, a_{i-1}

    A sliding joint adds q_i to d_i instead of theta_i.

    Args:
        table: Rows (theta, d, a, alpha), (n, 4) [rad, m, m, rad].
        convention: ``"standard"`` or ``"modified"``.
        name: The arm's name.
        joints: Joint names; None: j1, j2, ...
        prismatic: 0-based indices of joints that slide.
        inertials: Mass of every link in its DH frame i; None: unknown.
        base: Pose of frame 0 in the base, (4, 4).
        tool: Pose of the tip in the last DH frame, (4, 4).
        gravity: Gravity in the base frame, (3,) [m/s2].
    """
    rows = _rows(table)
    count = len(rows)
    names = [f"j{i + 1}" for i in range(count)] if joints is None else [str(joint) for joint in joints]
    if len(names) != count or len(set(names)) != count:
        raise InputError(
            f"joints has {len(set(names))} different names, expected {count}, one a row of the table"
        )
    masses = [None] * count if inertials is None else list(inertials)
    if len(masses) != count:
        raise InputError(f"inertials has {len(masses)} entries, expected {count}, one a row of the table")
    slides = {int(i) for i in prismatic}
    if not slides <= set(range(count)):
        raise InputError(f"prismatic is {sorted(slides)}, expected 0-based indices below {count}")
    if convention not in ("standard", "modified"):
        raise unknown("convention", convention, "DH tables", ["standard", "modified"])

    before = np.eye(4) if base is None else checked_pose(base, "base")
    bodies = []
    for i, (theta, d, a, alpha) in enumerate(rows):
        turn, lift = transform(rotation_z(theta), np.zeros(3)), _shift(0.0, 0.0, d)
        arm, twist = _shift(a, 0.0, 0.0), transform(rotation_x(alpha), np.zeros(3))
        if convention == "standard":
            place, behind = (before @ turn, lift @ arm @ twist)
        else:
            place, behind = (before @ twist @ arm @ lift @ turn, np.eye(4))
        mass = masses[i]
        parts = () if mass is None else ((behind, mass),)
        bodies.append(Body(name=names[i], placement=place, prismatic=i in slides, parts=parts))
        before = behind
    end = before if tool is None else before @ checked_pose(tool, "tool")
    weight = array("gravity", gravity, (3,), "(3,)")
    return serial_model(name, bodies, JointLimits.of(count), frames=[(TIP, end)], gravity=tuple(weight))


def _shift(x: float, y: float, z: float) -> FloatArray:
    return transform(np.eye(3), np.array([x, y, z]))


def _rows(table: Any) -> FloatArray:
    count = len(table) if isinstance(table, (list, tuple, np.ndarray)) else 0
    if count == 0:
        raise InputError(f"table is {table!r:.80}, expected rows (theta, d, a, alpha)")
    return array("table", table, (count, 4), "(n, 4), rows (theta, d, a, alpha)")
