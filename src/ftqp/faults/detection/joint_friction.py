"""Coulomb and viscous friction of every joint, from a log of healthy motion with torques."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.faults.detection.motion_log import MotionLog
from ftqp.model.fitting.fitted_arm import arm_of
from ftqp.model.fitting.torque_log import TorqueLog
from ftqp.model.robot import Robot

SLOWEST = 0.03
"""Joints slower than this [rad/s or m/s] do not show the sign of their friction to a detector."""
SIGNIFICANT = 3.0
"""Friction below so many standard errors is none, because noise alone makes that in 0.3 % of logs."""
MOST_PIECES = 3000
"""More pieces of motion show no more."""


class Friction(NamedTuple):
    """Friction of the joints beside that of the model.

    Attributes:
        coulomb: (nv,) [N m or N].
        viscous: (nv,) [N m s/rad or N s/m].
    """

    coulomb: FloatArray
    viscous: FloatArray


def friction_of(robot: Robot, logs: Sequence[MotionLog], dt: float, delay: int) -> Friction:
    """Friction by least squares with an unknown load at the tip and rotors: docs/how-to/identify.md."""
    none = Friction(np.zeros(robot.nv), np.zeros(robot.nv))
    if not robot.has_inertia:
        return none
    found = arm_of(
        robot,
        [_torques(log, dt, delay) for log in logs],
        ("rotors", "coulomb", "viscous", "load"),
        MOST_PIECES,
    )
    coulomb, viscous = found.coulomb, found.viscous
    rubs = ~found.not_shown["coulomb"] & (coulomb > SIGNIFICANT * found.errors["coulomb"])
    flows = ~found.not_shown["viscous"] & (np.abs(viscous) > SIGNIFICANT * found.errors["viscous"])
    return Friction(np.where(rubs, coulomb, 0.0), np.where(rubs | flows, viscous, 0.0))


def _torques(log: MotionLog, dt: float, delay: int) -> TorqueLog:
    """The log with the torques of its motors; those that were sent act later than samples were taken."""
    t: FloatArray = dt * np.arange(len(log), dtype=np.float64)
    if log.tau is not None:
        return TorqueLog(t=t, q=log.q, tau=log.tau)
    assert log.effort is not None
    return TorqueLog(t=t, q=log.q, tau=log.effort, late=(delay + 0.5) * dt)
