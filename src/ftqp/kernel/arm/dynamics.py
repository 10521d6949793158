"""Joint-space dynamics tau = M(q) a + h(q, v), in one pass tips to base, about the world's origin."""

from typing import Any

from ftqp.kernel.arm.mimicry import fold_row, fold_square
from ftqp.kernel.arm.points import moves
from ftqp.kernel.jit import part_jit
from ftqp.kernel.maths.vectors import cross


@part_jit
def dynamics(K: Any, state: Any) -> None:
    """M by the composite-rigid-body algorithm and h by the recursive Newton-Euler algorithm at a = 0.

    Needs ``forward_kinematics`` and ``motion``. M is 0 between joints of which neither carries the other. h
    holds Coriolis, centrifugal and gravity torques and viscous friction d_i v_i [N m or N]; Coulomb friction,
    whose sign a joint near rest does not have, is left out. With joints that mimic others they are E'M E and
    E'h, and 1 stands on the diagonal of M for those, which no torque moves.
    Source: Featherstone 2008, chapters 5 and 6; here in world coordinates.
    """
    chain, kinematics = K.chain, K.kinematics
    n = chain.n
    f0 = f1 = f2 = 0.0  # force and moment about the origin that the bodies from here to the tip need
    n0 = n1 = n2 = 0.0
    mass = 0.0  # composite body: mass, first moment c, second moment S (xx xy xz yy yz zz) about the origin
    c0 = c1 = c2 = 0.0
    S0 = S1 = S2 = S3 = S4 = S5 = 0.0
    if chain.is_tree:
        for i in range(n):
            for k in range(16):
                kinematics.carried[i, k] = 0.0
    for i in range(n - 1, -1, -1):
        if chain.branches[i]:
            C = kinematics.carried[i]
            f0, f1, f2, n0, n1, n2 = f0 + C[0], f1 + C[1], f2 + C[2], n0 + C[3], n1 + C[4], n2 + C[5]
            mass, c0, c1, c2 = mass + C[6], c0 + C[7], c1 + C[8], c2 + C[9]
            S0, S1, S2, S3, S4, S5 = S0 + C[10], S1 + C[11], S2 + C[12], S3 + C[13], S4 + C[14], S5 + C[15]
        R = kinematics.R[i]
        R0, R1, R2, R3, R4, R5, R6, R7, R8 = R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8]
        d0, d1, d2 = chain.com[i, 0], chain.com[i, 1], chain.com[i, 2]
        q0 = R0 * d0 + R1 * d1 + R2 * d2
        q1 = R3 * d0 + R4 * d1 + R5 * d2
        q2 = R6 * d0 + R7 * d1 + R8 * d2
        o0, o1, o2 = kinematics.o[i, 0], kinematics.o[i, 1], kinematics.o[i, 2]
        p0, p1, p2 = o0 + q0, o1 + q1, o2 + q2
        # inertia about the com along world axes: W = R I R'
        I = chain.inertia[i]
        I0, I1, I2, I3, I4, I5 = I[0], I[1], I[2], I[3], I[4], I[5]
        A0, A1, A2 = R0 * I0 + R1 * I1 + R2 * I2, R0 * I1 + R1 * I3 + R2 * I4, R0 * I2 + R1 * I4 + R2 * I5
        A3, A4, A5 = R3 * I0 + R4 * I1 + R5 * I2, R3 * I1 + R4 * I3 + R5 * I4, R3 * I2 + R4 * I4 + R5 * I5
        A6, A7, A8 = R6 * I0 + R7 * I1 + R8 * I2, R6 * I1 + R7 * I3 + R8 * I4, R6 * I2 + R7 * I4 + R8 * I5
        W0 = A0 * R0 + A1 * R1 + A2 * R2
        W1 = A0 * R3 + A1 * R4 + A2 * R5
        W2 = A0 * R6 + A1 * R7 + A2 * R8
        W3 = A3 * R3 + A4 * R4 + A5 * R5
        W4 = A3 * R6 + A4 * R7 + A5 * R8
        W5 = A6 * R6 + A7 * R7 + A8 * R8
        # Newton and Euler: f = m a_com, moment = W alpha + w x W w + p x f
        w0, w1, w2 = kinematics.w[i, 0], kinematics.w[i, 1], kinematics.w[i, 2]
        l0, l1, l2 = kinematics.alpha[i, 0], kinematics.alpha[i, 1], kinematics.alpha[i, 2]
        t0, t1, t2 = cross(w0, w1, w2, q0, q1, q2)
        u0, u1, u2 = cross(w0, w1, w2, t0, t1, t2)
        t0, t1, t2 = cross(l0, l1, l2, q0, q1, q2)
        m = chain.mass[i]
        a0, a1, a2 = (
            m * (kinematics.acc[i, 0] + t0 + u0),
            m * (kinematics.acc[i, 1] + t1 + u1),
            m * (kinematics.acc[i, 2] + t2 + u2),
        )
        k0, k1, k2 = W0 * w0 + W1 * w1 + W2 * w2, W1 * w0 + W3 * w1 + W4 * w2, W2 * w0 + W4 * w1 + W5 * w2
        t0, t1, t2 = cross(w0, w1, w2, k0, k1, k2)
        u0, u1, u2 = cross(p0, p1, p2, a0, a1, a2)
        f0 += a0
        f1 += a1
        f2 += a2
        n0 += W0 * l0 + W1 * l1 + W2 * l2 + t0 + u0
        n1 += W1 * l0 + W3 * l1 + W4 * l2 + t1 + u1
        n2 += W2 * l0 + W4 * l1 + W5 * l2 + t2 + u2
        # composite body
        mass += m
        x, y, z = m * p0, m * p1, m * p2
        c0 += x
        c1 += y
        c2 += z
        S0 += W0 + y * p1 + z * p2
        S1 += W1 - x * p1
        S2 += W2 - x * p2
        S3 += W3 + x * p0 + z * p2
        S4 += W4 - y * p2
        S5 += W5 + x * p0 + y * p1
        # momentum (F, N) of the composite body when joint i moves at unit speed: column i of M
        z0, z1, z2 = kinematics.axis_w[i, 0], kinematics.axis_w[i, 1], kinematics.axis_w[i, 2]
        if chain.prismatic[i]:
            kinematics.h[i] = z0 * f0 + z1 * f1 + z2 * f2
            F0, F1, F2 = mass * z0, mass * z1, mass * z2
            N0, N1, N2 = cross(c0, c1, c2, z0, z1, z2)
        else:
            t0, t1, t2 = cross(o0, o1, o2, f0, f1, f2)
            kinematics.h[i] = z0 * (n0 - t0) + z1 * (n1 - t1) + z2 * (n2 - t2)
            v0, v1, v2 = cross(o0, o1, o2, z0, z1, z2)
            t0, t1, t2 = cross(z0, z1, z2, c0, c1, c2)
            F0, F1, F2 = t0 + mass * v0, t1 + mass * v1, t2 + mass * v2
            t0, t1, t2 = cross(c0, c1, c2, v0, v1, v2)
            N0 = t0 + S0 * z0 + S1 * z1 + S2 * z2
            N1 = t1 + S1 * z0 + S3 * z1 + S4 * z2
            N2 = t2 + S2 * z0 + S4 * z1 + S5 * z2
        for j in range(i + 1):
            if not moves(chain, j, i):
                kinematics.M[j, i] = kinematics.M[i, j] = 0.0
                continue
            if chain.prismatic[j]:
                x = kinematics.axis_w[j, 0] * F0 + kinematics.axis_w[j, 1] * F1 + kinematics.axis_w[j, 2] * F2
            else:
                t0, t1, t2 = cross(kinematics.o[j, 0], kinematics.o[j, 1], kinematics.o[j, 2], F0, F1, F2)
                x = (
                    kinematics.axis_w[j, 0] * (N0 - t0)
                    + kinematics.axis_w[j, 1] * (N1 - t1)
                    + kinematics.axis_w[j, 2] * (N2 - t2)
                )
            kinematics.M[j, i] = x
            kinematics.M[i, j] = x
        kinematics.M[i, i] += chain.armature[i]
        above = chain.parent[i]
        if above != i - 1:
            if above >= 0:
                C = kinematics.carried[above]
                C[0], C[1], C[2], C[3], C[4], C[5] = (
                    C[0] + f0,
                    C[1] + f1,
                    C[2] + f2,
                    C[3] + n0,
                    C[4] + n1,
                    C[5] + n2,
                )
                C[6], C[7], C[8], C[9] = C[6] + mass, C[7] + c0, C[8] + c1, C[9] + c2
                C[10], C[11], C[12] = C[10] + S0, C[11] + S1, C[12] + S2
                C[13], C[14], C[15] = C[13] + S3, C[14] + S4, C[15] + S5
            f0 = f1 = f2 = n0 = n1 = n2 = mass = c0 = c1 = c2 = 0.0
            S0 = S1 = S2 = S3 = S4 = S5 = 0.0
    for i in range(n):  # apart from the loop above, whose rounding it leaves as it is
        kinematics.h[i] += chain.viscous[i] * state.v[i]
    if chain.mimics:
        fold_row(chain, kinematics.h)
        fold_square(chain, kinematics.M, 1.0)
