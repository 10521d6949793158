"""Joint-space dynamics tau = M(q) a + h(q, v), in one pass tips to base, about the world's origin."""

from typing import Any

from ftqp.kernel.arm.kinematics import fold_row, fold_square, moves
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.maths.vectors import (
    ZERO,
    add_to,
    cross,
    inner,
    length,
    minus,
    plus,
    rotated,
    rotated_back,
    symmetric,
    three,
    three_from,
    times,
    write,
)


@jit
def _turned_inertia(R: Any, I: Any) -> Any:
    """R I R' of a symmetric matrix (xx xy xz yy yz zz)."""
    a = symmetric(I, (R[0], R[1], R[2]))
    b = symmetric(I, (R[3], R[4], R[5]))
    c = symmetric(I, (R[6], R[7], R[8]))
    return (
        a[0] * R[0] + a[1] * R[1] + a[2] * R[2],
        a[0] * R[3] + a[1] * R[4] + a[2] * R[5],
        a[0] * R[6] + a[1] * R[7] + a[2] * R[8],
        b[0] * R[3] + b[1] * R[4] + b[2] * R[5],
        b[0] * R[6] + b[1] * R[7] + b[2] * R[8],
        c[0] * R[6] + c[1] * R[7] + c[2] * R[8],
    )


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
    f = m = c = ZERO  # force and moment about the origin that the bodies from here to the tip need
    mass = 0.0  # composite body: mass, first moment c, second moment S (xx xy xz yy yz zz) about the origin
    S0 = S1 = S2 = S3 = S4 = S5 = 0.0
    if chain.is_tree:
        for i in range(n):
            for k in range(16):
                kinematics.carried[i, k] = 0.0
    for i in range(n - 1, -1, -1):
        if chain.branches[i]:
            C = kinematics.carried[i]
            f, m, c = plus(f, three(C)), plus(m, three_from(C, 3)), plus(c, three_from(C, 7))
            mass, S0, S1, S2 = mass + C[6], S0 + C[10], S1 + C[11], S2 + C[12]
            S3, S4, S5 = S3 + C[13], S4 + C[14], S5 + C[15]
        R, o = kinematics.R[i], three(kinematics.o[i])
        q = rotated(R, three(chain.com[i]))
        p = plus(o, q)
        W = _turned_inertia(R, chain.inertia[i])  # about the com along world axes
        # Newton and Euler: f = m a_com, moment = W alpha + w x W w + p x f
        w, alpha, own = three(kinematics.w[i]), three(kinematics.alpha[i]), chain.mass[i]
        bent = cross(w, cross(w, q))
        a = times(own, plus(plus(three(kinematics.acc[i]), cross(alpha, q)), bent))
        f = plus(f, a)
        gyration = cross(w, symmetric(W, w))
        m = plus(m, plus(plus(symmetric(W, alpha), gyration), cross(p, a)))
        # composite body
        mass += own
        x, y, z = times(own, p)
        c = plus(c, (x, y, z))
        S0 += W[0] + y * p[1] + z * p[2]
        S1 += W[1] - x * p[1]
        S2 += W[2] - x * p[2]
        S3 += W[3] + x * p[0] + z * p[2]
        S4 += W[4] - y * p[2]
        S5 += W[5] + x * p[0] + y * p[1]
        # momentum (F, N) of the composite body when joint i moves at unit speed: column i of M
        axis = three(kinematics.axis_w[i])
        if chain.prismatic[i]:
            kinematics.h[i] = inner(axis, f)
            F, N = times(mass, axis), cross(c, axis)
        else:
            kinematics.h[i] = inner(axis, minus(m, cross(o, f)))
            v = cross(o, axis)
            F = plus(cross(axis, c), times(mass, v))
            N = plus(cross(c, v), symmetric((S0, S1, S2, S3, S4, S5), axis))
        for j in range(i + 1):
            if not moves(chain, j, i):
                kinematics.M[j, i] = kinematics.M[i, j] = 0.0
                continue
            other = F if chain.prismatic[j] else minus(N, cross(three(kinematics.o[j]), F))
            kinematics.M[j, i] = kinematics.M[i, j] = inner(three(kinematics.axis_w[j]), other)
        kinematics.M[i, i] += chain.armature[i]
        above = chain.parent[i]
        if above != i - 1:
            if above >= 0:
                C = kinematics.carried[above]
                add_to(C, 0, f)
                add_to(C, 3, m)
                C[6] += mass
                add_to(C, 7, c)
                add_to(C, 10, (S0, S1, S2))
                add_to(C, 13, (S3, S4, S5))
            f = m = c = ZERO
            mass = S0 = S1 = S2 = S3 = S4 = S5 = 0.0
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
    wrench, tau, n = kinematics.wrench, kinematics.tau, chain.n
    e = b = ZERO  # what a adds to the angular acceleration, and to that of the joint
    for i in range(n):
        o, above = three(kinematics.o[i]), chain.parent[i]
        if above != i - 1:
            e = b = ZERO
            if above >= 0:
                G = kinematics.gained[above]
                e, b = three(G), three_from(G, 3)
        if above >= 0:
            b = plus(b, cross(e, minus(o, three(kinematics.o[above]))))
        own = times(a[i], three(kinematics.axis_w[i]))
        if chain.prismatic[i]:
            b = plus(b, own)
        else:
            e = plus(e, own)
        if chain.branches[i]:
            write(kinematics.gained[i], 0, e)
            write(kinematics.gained[i], 3, b)
        alpha, w, R = plus(three(kinematics.alpha[i]), e), three(kinematics.w[i]), kinematics.R[i]
        q = rotated(R, three(chain.com[i]))
        bent = cross(w, cross(w, q))
        at_com = plus(plus(plus(three(kinematics.acc[i]), b), cross(alpha, q)), bent)
        f = times(chain.mass[i], at_com)
        I, y = chain.inertia[i], rotated_back(R, w)
        k = plus(symmetric(I, rotated_back(R, alpha)), cross(y, symmetric(I, y)))
        m = plus(rotated(R, k), cross(plus(o, q), f))
        write(wrench[i], 0, f)
        write(wrench[i], 3, m)
    f = m = ZERO
    for i in range(n - 1, -1, -1):
        F = wrench[i]
        f, m = plus(f, three(F)), plus(m, three_from(F, 3))
        carried = f if chain.prismatic[i] else minus(m, cross(three(kinematics.o[i]), f))
        moved = chain.armature[i] * a[i] + chain.viscous[i] * state.v[i]
        tau[i] = moved + inner(three(kinematics.axis_w[i]), carried)
        above = chain.parent[i]
        if above != i - 1:
            if above >= 0:
                add_to(wrench[above], 0, f)
                add_to(wrench[above], 3, m)
            f = m = ZERO
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
    It is 0 for a joint of a tree that neither carries i nor is carried. Needs ``forward_kinematics``.
    Source: docs/theory/free-swinging.md, "Gravity's torque".
    """
    n, G, z = chain.n, three(chain.gravity), three(kinematics.axis_w[i])
    e, mass, c, r = cross(z, G), 0.0, ZERO, ZERO
    if chain.is_tree:
        for j in range(n):
            for k in range(4):
                kinematics.carried[j, k] = 0.0
    for j in range(n - 1, i - 1, -1):
        if chain.branches[j]:
            C = kinematics.carried[j]
            mass, c = mass + C[0], plus(c, three_from(C, 1))
        m, o, y = chain.mass[j], three(kinematics.o[j]), three(kinematics.axis_w[j])
        mass += m
        c = plus(c, times(m, plus(o, rotated(kinematics.R[j], three(chain.com[j])))))
        r = minus(c, times(mass, o))
        if (chain.prismatic[i] and j > i) or not moves(chain, i, j):
            slope[j] = 0.0
        elif chain.prismatic[j]:
            slope[j] = 0.0 if j == i else -mass * inner(cross(z, y), G)
        else:
            slope[j] = inner(y, cross(r, e))
        above = chain.parent[j]
        if j > i and above != j - 1:
            if above >= 0:
                C = kinematics.carried[above]
                C[0] += mass
                add_to(C, 1, c)
            mass, c = 0.0, ZERO
    for j in range(i):
        y = three(kinematics.axis_w[j])
        if chain.prismatic[j] or not moves(chain, j, i):
            slope[j] = 0.0
        elif chain.prismatic[i]:
            slope[j] = -mass * inner(cross(y, z), G)
        else:
            slope[j] = inner(z, cross(r, cross(y, G)))
    return -mass * inner(z, G) if chain.prismatic[i] else -inner(z, cross(r, G))


@jit
def knows_no_gravity(kinematics: Any, chain: Any, i: int) -> bool:
    """Whether gravity's torque on joint i is zero in every posture: nothing before it tilts its axis."""
    G = three(chain.gravity)
    size = abs(G[0]) + abs(G[1]) + abs(G[2])
    if size == 0.0:
        return True
    for j in range(i + 1):
        y = three(kinematics.axis_w[j])
        tilt = cross(y, G)
        if chain.prismatic[j]:
            if j == i and abs(inner(y, G)) > 1e-9 * size:
                return False
        elif abs(tilt[0]) + abs(tilt[1]) + abs(tilt[2]) > 1e-9 * size:
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
    W = A = s = 0.0
    b = length(three(chain.gravity))
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
    chain.lever[body] = length(three(chain.com[body]))
    chain.stoutness[body] = base_stoutness + reduced * (x * x + y * y + z * z)
