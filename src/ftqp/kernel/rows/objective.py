"""The objective 1/2 x'Hx + g'x: three quadratic forms whose coefficients add up, so criteria do.

    1/2 w_norm |x|^2_D + x'D (norm_v v + norm_q (q - q_posture))          MVN, MAN, RMP
    1/2 w_inertia x'M x + x'(inertia_v M v + inertia_h h)                 MKE, IIWT
    1/2 w_torque |tau_H|^2                                                MTN, the torque part of DLSM

x is the acceleration or the velocity. At the velocity level torque is that of the acceleration (x - v)/dt,
times dt. D is
the diagonal of joint weights. tau_H leaves out the torque of every failed joint: its motor does not work, and
to keep its
torque in the objective would change the motion of the others.
"""

from math import cos, sin
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import FREE, HEALTHY, VELOCITY

DRIVE_GAIN = 4.0
"""How fast the null-space velocity approaches the drive at least, where it is a state [1/s]."""


@jit
def posture_error(K: Any, i: int) -> float:
    """q_i - posture_i; for a continuous joint the short way round, smooth: 2 sin(d/2) sign(cos(d/2))."""
    d = K.q[i] - K.posture[i]
    if K.continuous[i]:
        half = 0.5 * d
        return 2.0 * sin(half) * (1.0 if cos(half) >= 0.0 else -1.0)
    return d


@jit
def objective(K: Any) -> None:
    """H and g of the joints; H_diagonal alone when no criterion couples joints."""
    n = K.n
    for i in range(n):
        K.H_diagonal[i] = K.w_norm * K.weight[i]
        K.g[i] = K.weight[i] * K.norm_v * K.v[i]
        if K.norm_q != 0.0:
            K.g[i] += K.weight[i] * K.norm_q * posture_error(K, i)
    if K.w_inertia == 0.0 and K.w_torque == 0.0:
        K.dense = 0
        return
    K.dense = 1
    h_scale = K.dt if K.level == VELOCITY else 1.0
    for i in range(n):
        momentum = 0.0
        for j in range(n):
            K.H[i, j] = K.w_inertia * K.M[i, j]
            momentum += K.M[i, j] * K.v[j]
        K.H[i, i] += K.H_diagonal[i]
        K.g[i] += K.inertia_v * momentum + K.inertia_h * h_scale * K.h[i]
        K.scratch[i] = h_scale * K.h[i] - (momentum if K.level == VELOCITY else 0.0)
    if K.w_torque == 0.0:
        return
    for k in range(n):
        if K.fault[k] == HEALTHY:
            for i in range(n):
                c = K.w_torque * K.M[k, i]
                K.g[i] += c * K.scratch[k]
                for j in range(i + 1):
                    K.H[i, j] += c * K.M[k, j]
        elif (
            K.fault[k] == FREE
        ):  # w_torque/2 (row x - right side)^2 of its equality row: zero for every x that is
            for i in range(n):  # allowed, it changes no answer and keeps H > 0, as the row's own torque would
                c = K.w_torque * K.C[k, i]
                K.g[i] -= c * K.l[k]
                for j in range(i + 1):
                    K.H[i, j] += c * K.C[k, j]
    for i in range(n):
        for j in range(i):
            K.H[j, i] = K.H[i, j]


@jit
def add_drive(K: Any) -> None:
    """The objective of x - x_0 in place of x, g -= H x_0: the null space is drawn to the velocity ``drive``.

    Velocity level: x_0 = drive, or DRIVE_GAIN dt (drive - v) where the scheme keeps the last velocity.
    Acceleration level: x_0 = gain drive - (gain - own) v, own the velocity gain that the scheme has already
    and gain = max(DRIVE_GAIN, own).
    """
    n = K.n
    own = 0.0
    if K.w_norm > 0.0:
        own = K.norm_v / K.w_norm
    elif K.w_inertia > 0.0:
        own = K.inertia_v / K.w_inertia
    gain = max(DRIVE_GAIN, own)
    keeps = own < 0.0 or (K.w_norm == 0.0 and K.w_inertia == 0.0)
    for i in range(n):
        x = K.drive[i]
        if K.level != VELOCITY:
            x = gain * x - (gain - own) * K.v[i]
        elif keeps:
            x = DRIVE_GAIN * K.dt * (x - K.v[i])
        K.scratch[i] = x if K.fault[i] == HEALTHY else 0.0
    for i in range(n):
        if K.dense:
            for j in range(n):
                K.g[i] -= K.H[i, j] * K.scratch[j]
        else:
            K.g[i] -= K.H_diagonal[i] * K.scratch[i]
