"""What a motion can ask of the motors at most, by lengths, masses and speeds alone."""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit


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
