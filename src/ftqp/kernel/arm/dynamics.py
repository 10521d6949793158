"""Joint-space dynamics tau = M(q) a + h(q, v), in one pass tips to base, about the world's origin."""

from math import sqrt
from typing import Any

from ftqp.kernel.arm.kinematics import fold_row, fold_square, moves
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.maths.elementary import cross


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


@jit
def torque_bound(state: Any, kinematics: Any, chain: Any, a: Any) -> None:
    """No less than |M a + h|_i in any posture, for every joint, into ``kinematics.tau``.

    Newton and Euler with norms in the place of vectors: bodies turn at W_i = sum |v_j| at most and faster by
    A_i = A_(i-1) + |a_i| + W_(i-1) |v_i|, so that with s_i = A_i + W_i^2

        b_i = b_(i-1) + l_i s_(i-1),  b_0 = |g|              acceleration of joint i, l_i from the last
        f_i = m_i (b_i + c_i s_i)                            force of the body, its com at c_i
        F_i = F_(i+1) + f_i
        N_i = N_(i+1) + l_(i+1) F_(i+1) + c_i f_i + I_i s_i  moment about joint i

    bound F_i at a joint that slides and N_i at one that turns; a joint that slides adds |a_i| + 2 W |v_i| to
    b_i and |q_i| to l_i, and nothing to W and A. Rotors and viscous friction add theirs.
    Source: docs/theory/joint-limits.md, "Torque rows on demand".
    """
    effort, tau = kinematics.effort, kinematics.tau
    n = chain.n
    g0, g1, g2 = chain.gravity[0], chain.gravity[1], chain.gravity[2]
    W = A = s = 0.0
    b = sqrt(g0 * g0 + g1 * g1 + g2 * g2)
    for i in range(n):
        v, change = abs(state.v[i]), abs(a[i])
        b = b + chain.span[i] * s
        if chain.prismatic[i]:
            b = b + abs(state.q[i]) * s + 2.0 * W * v + change
        else:
            A = A + change + W * v
            W = W + v
            s = A + W * W
        f = chain.mass[i] * (b + chain.lever[i] * s)
        effort[i, 0] = f
        effort[i, 1] = chain.lever[i] * f + chain.stoutness[i] * s
        tau[i] = chain.armature[i] * change + chain.viscous[i] * v
    F = N = 0.0
    for k in range(n):
        i = n - 1 - k
        F = F + effort[i, 0]
        N = N + effort[i, 1]
        tau[i] = tau[i] + (F if chain.prismatic[i] else N)
        l = chain.span[i]
        N = N + l * F
        if chain.prismatic[i]:
            N = N + abs(state.q[i]) * F


@jit
def join(
    chain: Any, body: int, base_mass: float, base_com: Any, base_inertia: Any, base_stoutness: float,
    m: float, x: float, y: float, z: float,
) -> None:  # fmt: skip
    """Body ``body`` with a mass m at (x, y, z) of its frame fixed to it, by the theorem of parallel axes.

    Source: Featherstone 2008, section 2.13.
    """
    total = base_mass + m
    share = m / total if total > 0.0 else 0.0
    x, y, z = x - base_com[0], y - base_com[1], z - base_com[2]
    reduced = base_mass * share  # of the two bodies about their common centre
    chain.mass[body] = total
    chain.com[body, 0] = base_com[0] + share * x
    chain.com[body, 1] = base_com[1] + share * y
    chain.com[body, 2] = base_com[2] + share * z
    I, base = chain.inertia[body], base_inertia
    I[0], I[3], I[5] = (
        base[0] + reduced * (y * y + z * z),
        base[3] + reduced * (x * x + z * z),
        base[5] + reduced * (x * x + y * y),
    )
    I[1], I[2], I[4] = base[1] - reduced * x * y, base[2] - reduced * x * z, base[4] - reduced * y * z
    c = chain.com[body]
    chain.lever[body] = sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2])
    chain.stoutness[body] = base_stoutness + reduced * (x * x + y * y + z * z)
