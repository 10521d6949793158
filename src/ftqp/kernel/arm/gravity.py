"""Gravity's torque on one joint of an arm at rest, and how it changes with the posture."""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.vectors import cross


@jit
def gravity_torque(kinematics: Any, chain: Any, i: int, slope: Any) -> float:
    """g_i [N m or N] of tau = M a + h at v = 0, and its gradient d g_i/d q_j in ``slope``, (n,).

    With the mass m_b that joint b carries and its first moment r_b about the joint's origin,

        g_b = -z_b . (r_b x G)   (revolute),   g_b = -m_b z_b . G   (prismatic),

    G the acceleration of gravity. To turn all that a revolute joint a before b carries is to turn G back:
    d g_b/d q_a = z_b . (r_b x (z_a x G)), and -m_b (z_a x z_b) . G for a prismatic b; a prismatic a changes
    nothing beyond it. The gradient of a potential's gradient is symmetric, which gives the joints after i.
    Needs ``forward_kinematics``.
    Source: docs/theory/free-swinging.md, "Gravity's torque".
    """
    n = chain.n
    G0, G1, G2 = chain.gravity[0], chain.gravity[1], chain.gravity[2]
    z0, z1, z2 = kinematics.axis_w[i, 0], kinematics.axis_w[i, 1], kinematics.axis_w[i, 2]
    e0, e1, e2 = cross(z0, z1, z2, G0, G1, G2)
    mass = c0 = c1 = c2 = 0.0
    torque = 0.0
    for j in range(n - 1, i - 1, -1):
        m = chain.mass[j]
        R, d = kinematics.R[j], chain.com[j]
        mass += m
        c0 += m * (kinematics.o[j, 0] + R[0] * d[0] + R[1] * d[1] + R[2] * d[2])
        c1 += m * (kinematics.o[j, 1] + R[3] * d[0] + R[4] * d[1] + R[5] * d[2])
        c2 += m * (kinematics.o[j, 2] + R[6] * d[0] + R[7] * d[1] + R[8] * d[2])
        y0, y1, y2 = kinematics.axis_w[j, 0], kinematics.axis_w[j, 1], kinematics.axis_w[j, 2]
        r0, r1, r2 = (
            c0 - mass * kinematics.o[j, 0],
            c1 - mass * kinematics.o[j, 1],
            c2 - mass * kinematics.o[j, 2],
        )
        if chain.prismatic[i] and j > i:
            slope[j] = 0.0
        elif chain.prismatic[j]:
            t0, t1, t2 = cross(z0, z1, z2, y0, y1, y2)
            slope[j] = 0.0 if j == i else -mass * (t0 * G0 + t1 * G1 + t2 * G2)
        else:
            t0, t1, t2 = cross(r0, r1, r2, e0, e1, e2)
            slope[j] = y0 * t0 + y1 * t1 + y2 * t2
    r0, r1, r2 = (
        c0 - mass * kinematics.o[i, 0],
        c1 - mass * kinematics.o[i, 1],
        c2 - mass * kinematics.o[i, 2],
    )
    if chain.prismatic[i]:
        torque = -mass * (z0 * G0 + z1 * G1 + z2 * G2)
    else:
        t0, t1, t2 = cross(r0, r1, r2, G0, G1, G2)
        torque = -(z0 * t0 + z1 * t1 + z2 * t2)
    for j in range(i):
        if chain.prismatic[j]:
            slope[j] = 0.0
            continue
        y0, y1, y2 = kinematics.axis_w[j, 0], kinematics.axis_w[j, 1], kinematics.axis_w[j, 2]
        if chain.prismatic[i]:
            t0, t1, t2 = cross(y0, y1, y2, z0, z1, z2)
            slope[j] = -mass * (t0 * G0 + t1 * G1 + t2 * G2)
        else:
            t0, t1, t2 = cross(y0, y1, y2, G0, G1, G2)
            u0, u1, u2 = cross(r0, r1, r2, t0, t1, t2)
            slope[j] = z0 * u0 + z1 * u1 + z2 * u2
    return torque


@jit
def knows_no_gravity(kinematics: Any, chain: Any, i: int) -> bool:
    """Whether gravity's torque on joint i is zero in every posture: nothing before it tilts its axis."""
    G0, G1, G2 = chain.gravity[0], chain.gravity[1], chain.gravity[2]
    size = abs(G0) + abs(G1) + abs(G2)
    if size == 0.0:
        return True
    for j in range(i + 1):
        y0, y1, y2 = kinematics.axis_w[j, 0], kinematics.axis_w[j, 1], kinematics.axis_w[j, 2]
        t0, t1, t2 = cross(y0, y1, y2, G0, G1, G2)
        if chain.prismatic[j]:
            if j == i and abs(y0 * G0 + y1 * G1 + y2 * G2) > 1e-9 * size:
                return False
        elif abs(t0) + abs(t1) + abs(t2) > 1e-9 * size:
            return False
    return True
