"""How hard each joint would fall onto its end stop if it lost motor and brake in a posture."""

from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.kernel.entry.session import ArmSession
from ftqp.model.robot import Robot

EVALUATIONS = 24
"""Gravity is looked at in so many places of a joint's way."""


def fall_energy(robot: Robot, q: Any) -> dict[str, float]:
    """The energy [J] with which each joint alone, the others held, falls from rest onto its stop.

    W_i = -int g_i dq_i from q_i downhill to the stop, friction left out; 0 where the joint swings back before
    it reaches the stop, and where it has none. A posture with little energy in it is a safer place to wait.
    Source: docs/theory/free-swinging.md, "The posture before".

    Args:
        robot: The arm; it has masses.
        q: The posture, (nv,) joint values or (nq,) [rad or m].

    Returns:
        The energy by joint name [J].

    Raises:
        InputError: The robot has no masses, or q has a wrong shape.
    """
    if not robot.has_inertia:
        raise InputError(f"{robot.name} has no inertia, so no joint falls; give the model its masses")
    posture = robot.angles(q)
    arm = ArmSession(robot.chain.constants())
    return {joint: _fall(arm, robot, posture, i) for i, joint in enumerate(robot.joints)}


def _fall(arm: ArmSession, robot: Robot, posture: FloatArray, i: int) -> float:
    """The energy of joint i."""
    g = _gravity(arm, posture, i)
    stop = float(robot.limits.q_min[i] if g > 0.0 else robot.limits.q_max[i])
    if g == 0.0 or not np.isfinite(stop):
        return 0.0
    way = np.linspace(posture[i], stop, EVALUATIONS)
    moved = posture.copy()
    torques = np.empty(EVALUATIONS)
    for k, moved[i] in enumerate(way):
        torques[k] = _gravity(arm, moved, i)
    mean = 0.5 * (torques[1:] + torques[:-1])
    gained = -np.cumsum(mean * np.diff(way))
    return float(gained[-1]) if (gained > 0.0).all() else 0.0


def _gravity(arm: ArmSession, q: FloatArray, i: int) -> float:
    """Gravity's torque on joint i."""
    arm.dynamics(q)
    return float(arm.K.kinematics.h[i])
