"""Points of an arm's bodies: where they are, and how they move; needs ``forward_kinematics``."""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.vectors import cross


@jit
def moves(chain: Any, joint: int, body: int) -> bool:
    """Whether a body moves with a joint: it is on the way from the base to it."""
    return (chain.ancestors[body] >> joint) & 1 != 0


@jit
def turned(kinematics: Any, body: int, x: Any) -> tuple[float, float, float]:
    """A vector of a joint's frame along W; of the base where there is no joint."""
    if body < 0:
        return x[0], x[1], x[2]
    R = kinematics.R[body]
    return (
        R[0] * x[0] + R[1] * x[1] + R[2] * x[2],
        R[3] * x[0] + R[4] * x[1] + R[5] * x[2],
        R[6] * x[0] + R[7] * x[1] + R[8] * x[2],
    )


@jit
def point_of(kinematics: Any, body: int, x: Any) -> tuple[float, float, float]:
    """A point of a joint's frame in W."""
    p0, p1, p2 = turned(kinematics, body, x)
    if body < 0:
        return p0, p1, p2
    return p0 + kinematics.o[body, 0], p1 + kinematics.o[body, 1], p2 + kinematics.o[body, 2]


@jit
def point_column(
    kinematics: Any, chain: Any, joint: int, p0: float, p1: float, p2: float
) -> tuple[float, float, float]:
    """Column of a joint in the Jacobian of a point that moves with it: z x (p - o), or z where it slides."""
    z0, z1, z2 = kinematics.axis_w[joint, 0], kinematics.axis_w[joint, 1], kinematics.axis_w[joint, 2]
    if chain.prismatic[joint]:
        return z0, z1, z2
    o = kinematics.o[joint]
    return cross(z0, z1, z2, p0 - o[0], p1 - o[1], p2 - o[2])


@jit
def point_drift(
    kinematics: Any, chain: Any, body: int, r0: float, r1: float, r2: float
) -> tuple[float, float, float]:
    """Jdot v of a point that lies (r0, r1, r2) from the origin of a joint's frame; needs ``motion``."""
    w, alpha = kinematics.w[body], kinematics.alpha[body]
    t0, t1, t2 = cross(w[0], w[1], w[2], r0, r1, r2)
    u0, u1, u2 = cross(w[0], w[1], w[2], t0, t1, t2)
    t0, t1, t2 = cross(alpha[0], alpha[1], alpha[2], r0, r1, r2)
    return (
        kinematics.acc[body, 0] + chain.gravity[0] + t0 + u0,
        kinematics.acc[body, 1] + chain.gravity[1] + t1 + u1,
        kinematics.acc[body, 2] + chain.gravity[2] + t2 + u2,
    )
