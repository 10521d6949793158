"""What may be unknown of an arm: each kind with its unit, its usual size, and what it adds to the torques."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, final

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray
from ftqp.model.chain import frame_id
from ftqp.model.fitting.torque_log import Pieces
from ftqp.model.robot import Robot

HALF = 0.5
"""A rotor that takes half of the torque limit at the acceleration limit is a large one, and so on. What is
usual is only where the fit begins, and by how much it is told from what the motion says."""
RUBS = 0.3
"""The same of friction, as a share of the torque limit."""
GAIN = 0.1
"""A motor whose torque constant is off by so much [1] is far off; ..."""
OFFSET = 0.05
"""... and so is an encoder by so much [rad or m]."""
GRAVITY = 9.81
"""Of the planet, to weigh a load by the strongest joint [m/s2]."""


@final
@dataclass(frozen=True, slots=True)
class Unknown:
    """A kind of unknown."""

    about: str  # What it is, in words
    unit: str  # Its unit where joints turn
    # How large it may well be, from the arm, the torques where it has no limits, and the reach
    usual: Callable[["Sizes"], Any]
    # What one unit of each adds to the torques, (S, nv, p), from the arm, the pieces of the motion, and the
    # torques (S, nv) that all unknowns so far make
    columns: Callable[[Robot, Pieces, FloatArray], FloatArray]
    size: int = 0  # How many there are, one a joint (0) or so many of the whole arm
    told: float = 0.15  # What an error of this share of ``usual`` is still worth telling


class Sizes(NamedTuple):
    """What is large for an arm, each (nv,) but for the last two."""

    tau: FloatArray  # Torques [N m or N]
    v: FloatArray  # Speeds [rad/s or m/s]
    a: FloatArray  # Accelerations [rad/s2 or m/s2]
    load: float  # A mass that the strongest joint can just hold half of at full reach [kg]
    length: float  # The arm's characteristic length [m]


def sizes_of(robot: Robot, pieces: Pieces) -> Sizes:
    """What is large for this arm; where it has no torque limit, what the motion shows."""
    shown = np.maximum(np.abs(pieces.tau).max(axis=0), 1e-3)
    tau = np.where(np.isfinite(robot.limits.tau_max), robot.limits.tau_max, shown)
    v = np.where(np.isfinite(robot.limits.v_max), robot.limits.v_max, 1.0)
    a = np.where(np.isfinite(robot.limits.a_max), robot.limits.a_max, 10.0)
    reach = 6.0 * robot.length
    turning = ~robot.chain.prismatic
    strongest = float((tau * turning).max()) or float(tau.max())
    return Sizes(tau, v, a, HALF * strongest / (GRAVITY * reach), robot.length)


def _each(x: FloatArray) -> FloatArray:
    """A column a joint: (S, nv, nv) with x on the diagonals."""
    result: FloatArray = x[:, :, None] * np.eye(x.shape[1])
    return result


def torques(robot: Robot, pieces: Pieces) -> FloatArray:
    """What the model asks for, viscous friction included and dry friction not, (S, nv) [N m or N]."""
    model, data = robot.model, robot.model.createData()
    return np.array(
        [
            pin.rnea(model, data, robot.configuration(q), v, a) + robot.viscous * v
            for q, v, a in zip(pieces.q, pieces.v, pieces.a, strict=True)
        ]
    )


def _loads(robot: Robot, pieces: Pieces, _: FloatArray) -> FloatArray:
    """Mass, first moments (3) and moments of inertia (6) of a body at the tip, about and along its axes."""
    model, data = robot.model, robot.model.createData()
    frame = model.frames[frame_id(model, robot.tip)]
    body, to_joint = frame.parentJoint - 1, _to_joint(frame.placement)
    found = []
    for q, v, a in zip(pieces.q, pieces.v, pieces.a, strict=True):
        whole = pin.computeJointTorqueRegressor(model, data, robot.configuration(q), v, a)
        found.append(whole[:, 10 * body : 10 * body + 10] @ to_joint)
    return np.array(found)


def _to_joint(placement: Any) -> FloatArray:
    """The linear map of (m, m c, I) about a frame to those about the joint that it moves with, (10, 10)."""
    result = np.zeros((10, 10))
    R, p = np.array(placement.rotation), np.array(placement.translation)
    for k in range(10):
        unit = np.eye(10)[k]
        m, first, moments = unit[0], R @ unit[1:4], R @ symmetric(unit[4:]) @ R.T
        mixed = np.outer(p, first) + np.outer(first, p)
        moments = moments + 2.0 * (p @ first) * np.eye(3) - mixed + m * (p @ p * np.eye(3) - np.outer(p, p))
        first = first + m * p
        xx, xy, yy, xz, yz, zz = (moments[i, j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)))
        result[:, k] = [m, *first, xx, xy, yy, xz, yz, zz]
    return result


def symmetric(six: FloatArray) -> FloatArray:
    """The matrix of pinocchio's order xx, xy, yy, xz, yz, zz, (3, 3)."""
    xx, xy, yy, xz, yz, zz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _turned(robot: Robot, pieces: Pieces, _: FloatArray) -> FloatArray:
    """How the torques change with the positions."""
    model, data = robot.model, robot.model.createData()
    found = []
    for q, v, a in zip(pieces.q, pieces.v, pieces.a, strict=True):
        pin.computeRNEADerivatives(model, data, robot.configuration(q), v, a)
        found.append(np.array(data.dtau_dq))
    return np.array(found)


LOAD = "load"
KINDS: dict[str, Unknown] = {
    "rotors": Unknown(
        "rotor inertia", "kg m2", lambda s: HALF * s.tau / s.a, lambda robot, at, made: _each(at.a)
    ),
    "coulomb": Unknown(
        "dry friction", "N m", lambda s: RUBS * s.tau, lambda robot, at, made: _each(np.sign(at.v))
    ),
    "viscous": Unknown(
        "viscous friction", "N m s/rad", lambda s: RUBS * s.tau / s.v, lambda robot, at, made: _each(at.v)
    ),
    "gains": Unknown(
        "gain of the torques", "1", lambda s: GAIN + 0.0 * s.tau,
        lambda robot, at, made: _each(made), told=0.3,
    ),
    "offsets": Unknown("encoder offset", "rad", lambda s: OFFSET + 0.0 * s.tau, _turned, told=0.3),
    LOAD: Unknown(
        "load at the tip", "kg, kg m, kg m2",
        lambda s: s.load * s.length ** np.array([0.0, 1, 1, 1, 2, 2, 2, 2, 2, 2]), _loads, size=10,
    ),
}  # fmt: skip
"""The kinds of unknowns, by name; each adds its columns to one regression."""
