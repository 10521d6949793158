"""Torques of one acceleration, tau = M(q) a + h(q, v), without M."""

from typing import Any

from ftqp.kernel.arm.mimicry import fold_row
from ftqp.kernel.jit import jit
from ftqp.kernel.maths.vectors import cross


@jit
def torques_of(state: Any, kinematics: Any, chain: Any, a: Any) -> None:
    """tau = M a + h by the recursive Newton-Euler algorithm, into ``kinematics.tau`` [N m or N].

    Needs ``forward_kinematics`` and ``motion``, to which the part of a is added; the rest of tau is that of
    ``dynamics``. A wrench is a force and its moment about the world's origin.
    Source: Featherstone 2008, chapter 5; here in world coordinates, Euler's equation along the body's axes.
    """
    wrench, tau, o = kinematics.wrench, kinematics.tau, kinematics.o
    n = chain.n
    e0 = e1 = e2 = 0.0  # what a adds to the angular acceleration, and to that of the joint
    b0 = b1 = b2 = 0.0
    for i in range(n):
        o0, o1, o2 = o[i, 0], o[i, 1], o[i, 2]
        above = chain.parent[i]
        if above != i - 1:
            e0 = e1 = e2 = b0 = b1 = b2 = 0.0
            if above >= 0:
                G = kinematics.gained[above]
                e0, e1, e2, b0, b1, b2 = G[0], G[1], G[2], G[3], G[4], G[5]
        if above >= 0:
            t0, t1, t2 = cross(e0, e1, e2, o0 - o[above, 0], o1 - o[above, 1], o2 - o[above, 2])
            b0, b1, b2 = b0 + t0, b1 + t1, b2 + t2
        z0, z1, z2 = kinematics.axis_w[i, 0], kinematics.axis_w[i, 1], kinematics.axis_w[i, 2]
        if chain.prismatic[i]:
            b0, b1, b2 = b0 + z0 * a[i], b1 + z1 * a[i], b2 + z2 * a[i]
        else:
            e0, e1, e2 = e0 + z0 * a[i], e1 + z1 * a[i], e2 + z2 * a[i]
        if chain.branches[i]:
            G = kinematics.gained[i]
            G[0], G[1], G[2], G[3], G[4], G[5] = e0, e1, e2, b0, b1, b2
        l0, l1, l2 = kinematics.alpha[i, 0] + e0, kinematics.alpha[i, 1] + e1, kinematics.alpha[i, 2] + e2
        w0, w1, w2 = kinematics.w[i, 0], kinematics.w[i, 1], kinematics.w[i, 2]
        R = kinematics.R[i]
        R0, R1, R2, R3, R4, R5, R6, R7, R8 = R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8]
        d0, d1, d2 = chain.com[i, 0], chain.com[i, 1], chain.com[i, 2]
        q0, q1, q2 = R0 * d0 + R1 * d1 + R2 * d2, R3 * d0 + R4 * d1 + R5 * d2, R6 * d0 + R7 * d1 + R8 * d2
        t0, t1, t2 = cross(w0, w1, w2, q0, q1, q2)
        u0, u1, u2 = cross(w0, w1, w2, t0, t1, t2)
        t0, t1, t2 = cross(l0, l1, l2, q0, q1, q2)
        m = chain.mass[i]
        f0 = m * (kinematics.acc[i, 0] + b0 + t0 + u0)
        f1 = m * (kinematics.acc[i, 1] + b1 + t1 + u1)
        f2 = m * (kinematics.acc[i, 2] + b2 + t2 + u2)
        I = chain.inertia[i]
        x0, x1, x2 = R0 * l0 + R3 * l1 + R6 * l2, R1 * l0 + R4 * l1 + R7 * l2, R2 * l0 + R5 * l1 + R8 * l2
        y0, y1, y2 = R0 * w0 + R3 * w1 + R6 * w2, R1 * w0 + R4 * w1 + R7 * w2, R2 * w0 + R5 * w1 + R8 * w2
        k0 = I[0] * y0 + I[1] * y1 + I[2] * y2
        k1 = I[1] * y0 + I[3] * y1 + I[4] * y2
        k2 = I[2] * y0 + I[4] * y1 + I[5] * y2
        t0, t1, t2 = cross(y0, y1, y2, k0, k1, k2)
        k0 = I[0] * x0 + I[1] * x1 + I[2] * x2 + t0
        k1 = I[1] * x0 + I[3] * x1 + I[4] * x2 + t1
        k2 = I[2] * x0 + I[4] * x1 + I[5] * x2 + t2
        t0, t1, t2 = cross(o0 + q0, o1 + q1, o2 + q2, f0, f1, f2)
        wrench[i, 0], wrench[i, 1], wrench[i, 2] = f0, f1, f2
        wrench[i, 3] = R0 * k0 + R1 * k1 + R2 * k2 + t0
        wrench[i, 4] = R3 * k0 + R4 * k1 + R5 * k2 + t1
        wrench[i, 5] = R6 * k0 + R7 * k1 + R8 * k2 + t2
    f0 = f1 = f2 = 0.0
    n0 = n1 = n2 = 0.0
    for k in range(n):
        i = n - 1 - k
        f0, f1, f2 = f0 + wrench[i, 0], f1 + wrench[i, 1], f2 + wrench[i, 2]
        n0, n1, n2 = n0 + wrench[i, 3], n1 + wrench[i, 4], n2 + wrench[i, 5]
        z0, z1, z2 = kinematics.axis_w[i, 0], kinematics.axis_w[i, 1], kinematics.axis_w[i, 2]
        own = chain.armature[i] * a[i] + chain.viscous[i] * state.v[i]
        if chain.prismatic[i]:
            tau[i] = own + z0 * f0 + z1 * f1 + z2 * f2
        else:
            t0, t1, t2 = cross(o[i, 0], o[i, 1], o[i, 2], f0, f1, f2)
            tau[i] = own + z0 * (n0 - t0) + z1 * (n1 - t1) + z2 * (n2 - t2)
        above = chain.parent[i]
        if above != i - 1:
            if above >= 0:
                F = wrench[above]
                F[0], F[1], F[2], F[3], F[4], F[5] = (
                    F[0] + f0,
                    F[1] + f1,
                    F[2] + f2,
                    F[3] + n0,
                    F[4] + n1,
                    F[5] + n2,
                )
            f0 = f1 = f2 = n0 = n1 = n2 = 0.0
    if chain.mimics:
        fold_row(chain, tau)
