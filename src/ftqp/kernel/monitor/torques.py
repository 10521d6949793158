"""The row of a joint that takes torques: that of a servo whose spring is left out.

    tau = (1 + s) ID(q, v, a) + m a + f sgn(v) + b + c v,    all signals behind three poles at w

in units of a fifth of the torque limit. ID is the model's inverse dynamics, with the load that was learned; s
is the share by which its masses are wrong, m the rotor, f dry and c viscous friction, b what nobody knows.
All else, what is learned and what counts as evidence, is that of servos.
Source: docs/theory/monitor.md, "Torque drives".
"""

from typing import Any

from ftqp.kernel.arm.dynamics import torques_of
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import NOTHING_HEARD

OTHERWISE = 0.05
"""The row misses so much [fifths of the torque limit] for other reasons: a hundredth of the limit."""
TORQUE_CREEP = 0.02
"""What nobody knows changes by so much per root of a second, beside its drift with the way."""
A_RADIAN = 50.0
"""What the row misses of a joint's motion is so many times what a servo's misses of it, in their units."""


@jit
def take_torques(K: Any, then: int) -> None:
    """Three poles for the torque that led to a sample, and for the sample; ``then`` it was taken."""
    M, feedback, p = K.monitor, K.feedback, K.monitor.pole
    heard = K.state.unusable != NOTHING_HEARD
    before = then - 1 if then > 0 else feedback.span - 1
    for i in range(K.chain.n):
        u = K.past.tau[before, i] * M.unit[i] if heard else M.u[i]
        y = feedback.good[i] if feedback.age[i] == 0 else M.y[i] + K.state.dt * feedback.v_hat[i]
        M.y[i], M.u[i] = y, u
        M.total[i] += y
        for k in range(3):
            M.u_f[k, i] = u = u + p * (M.u_f[k, i] - u)
            M.y_f[k, i] = y = y + p * (M.y_f[k, i] - y)


@rare_jit
def model_torques(K: Any) -> None:
    """What the model says that the motion takes of each joint, rotors that were learned aside."""
    M, supposed, D = K.monitor, K.supposed, K.monitor.D
    for i in range(K.chain.n):
        supposed.q[i], supposed.v[i] = M.y_f[2, i], D * (M.y_f[1, i] - M.y_f[2, i])
        M.a[i] = D * D * (M.y_f[0, i] - 2.0 * M.y_f[1, i] + M.y_f[2, i])
    forward_kinematics(K, supposed)
    motion(K, supposed)
    torques_of(supposed, K.kinematics, K.chain, M.a)
    for i in range(K.chain.n):
        M.weight[i] = (K.kinematics.tau[i] - K.learned.used[i] * M.a[i]) * M.unit[i]


@jit
def noise_of_torque(K: Any, i: int) -> float:
    """Variance of what noise of all samples makes of joint i's row: of a it is 3/16 sigma^2 w^5 dt."""
    M, w, total = K.monitor, K.monitor.w, 0.0
    for j in range(K.chain.n):
        m = K.feedback.M[i, j] * K.held.sigma[j]
        total += m * m
    return float(0.1875 * w * w * w * w * w * K.state.dt * M.unit[i] * M.unit[i] * total)
