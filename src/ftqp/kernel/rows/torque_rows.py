"""Torque limits and free-swinging joints as rows of the QP."""

from math import inf
from typing import Any

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import motion
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import BRAKING, FREE, LOCKED, VELOCITY


@jit
def add_torques(K: Any) -> None:
    """M, h and the torque rows of this tick."""
    if K.level == VELOCITY:
        motion(K)
    dynamics(K)
    torque_rows(K)
    K.has_torques = 1


@jit
def within_guard(K: Any) -> bool:
    """Whether x asks for so little acceleration that every torque limit holds without being looked at.

    max_i |a_i| / a_max_i <= guard, where the planner has made sure that |h| + guard |M| a_max stays below the
    torque limits.
    """
    for i in range(K.n):
        a = K.x[i] if K.level != VELOCITY else (K.x[i] - K.v[i]) / K.dt
        if not abs(a) <= K.guard * K.a_max[i]:
            return False
    return True


@jit
def torque_rows(K: Any) -> None:
    """l <= M x <= u, one row a joint: tau_min - h <= M a <= tau_max - h, times dt at the velocity level.

    A free-swinging joint's row is the equality tau = -damping v, with the velocity after the step: taken
    before it, strong
    friction on a light joint would be unstable. A braking or locked joint's row is open, its brake
    carries whatever is needed.
    """
    n = K.n
    K.nc = n
    scale = K.dt if K.level == VELOCITY else 1.0
    for i in range(n):
        shift = -scale * K.h[i]
        for j in range(n):
            K.C[i, j] = K.M[i, j]
            if K.level == VELOCITY:
                shift += K.M[i, j] * K.v[j]
        K.C[i, n] = 0.0
        fault = K.fault[i]
        if fault == FREE:
            friction = K.damping[i] * K.dt
            K.C[i, i] += friction
            K.l[i] = K.u[i] = shift - (0.0 if K.level == VELOCITY else K.damping[i] * K.v[i])
        elif fault == LOCKED or fault == BRAKING:
            K.l[i], K.u[i] = -inf, inf
        else:
            K.l[i], K.u[i] = shift - scale * K.tau_max[i], shift + scale * K.tau_max[i]
