"""What the kernel says of an arm at one state, apart from any planner."""

from dataclasses import dataclass
from typing import Any

from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.session import ArmSession
from ftqp.model.robot import Robot


@dataclass(frozen=True, slots=True, kw_only=True)
class ArmAt:
    """Kinematics and dynamics at (q, v).

    Attributes:
        J: Jacobian of the tip, linear rows first, (6, nv).
        drift: Its time derivative times v, (6,).
        M: Joint inertia, (nv, nv).
        h: Bias torques, (nv,).
    """

    J: FloatArray
    drift: FloatArray
    M: FloatArray
    h: FloatArray


def arm_at(robot: Robot, q: Any, v: Any = None) -> ArmAt:
    """The arm at (q, v); v None is rest."""
    arm, n = ArmSession(robot.chain.constants()), robot.nv
    arm.dynamics(q, v)
    k = arm.K.kinematics
    return ArmAt(J=k.J[:, :n].copy(), drift=k.drift.copy(), M=k.M[:n, :n].copy(), h=k.h[:n].copy())
