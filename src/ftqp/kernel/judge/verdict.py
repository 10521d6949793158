"""What an answer is worth and what it commands: residuals, clamp, integration."""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import ACCELERATION, BRAKING, HEALTHY, LOCKED
from ftqp.kernel.maths.finite import is_finite


@jit
def judge(K: Any) -> bool:
    """Clamp x into the box, recompute every residual, and say whether the answer counts as solved.

    residual_task: max |A x + s - b| with s = soft lam, over 1 + max |b|; residual_bounds: what the rows of C
    are violated
    by, over 1 + max |x|; residual_dual: max |Hx + g + A'y + C'z + z_box|, over 1 + the norm of its terms.
    Wrong signs of multipliers count into residual_dual.
    """
    n, m = K.nx, K.meq
    size_x = 0.0
    for i in range(n):
        x = min(max(K.x[i], K.lb[i]), K.ub[i])
        if not is_finite(x):
            K.residual_bounds = inf
            return False
        K.x[i] = x
        size_x = max(size_x, abs(x))
    worst, size = 0.0, 0.0
    for k in range(m):
        s = -K.b[k]
        for i in range(n):
            s += K.A[k, i] * K.x[i]
        size = max(size, abs(K.b[k]))
        worst = max(worst, abs(s - K.soft[k] * K.y[k]))
        K.slack[k] = s + K.b[k] - K.b_task[k]
    K.residual_task = worst / (1.0 + size)
    worst, excess = 0.0, 0.0
    for j in range(K.nc):
        s = 0.0
        for i in range(n):
            s += K.C[j, i] * K.x[i]
        over = max(K.l[j] - s, s - K.u[j])
        if over > excess:
            excess = over
        if K.soft_rows > 0.0 and K.l[j] < K.u[j]:
            over = 0.0
        worst = max(worst, over)
    K.torque_excess = excess
    K.residual_bounds = worst / (1.0 + size_x)
    r = K.scratch
    size = 0.0
    for i in range(n):
        r[i] = K.g[i]
        size += r[i] * r[i]
    if K.dense:
        for i in range(n):
            s = 0.0
            for j in range(n):
                s += K.H[i, j] * K.x[j]
            r[i] += s
            size += s * s
    else:
        for i in range(n):
            s = K.H_diagonal[i] * K.x[i]
            r[i] += s
            size += s * s
    for k in range(m):
        y = K.y[k]
        for i in range(n):
            s = K.A[k, i] * y
            r[i] += s
            size += s * s
    for k in range(K.nc):
        y = K.z[k]
        if y != 0.0:
            for i in range(n):
                s = K.C[k, i] * y
                r[i] += s
                size += s * s
    worst = 0.0
    for i in range(n):
        z = K.z_box[i]
        if not is_finite(r[i] + z):  # max would lose a NaN
            K.residual_dual = inf
            return False
        worst = max(worst, abs(r[i] + z))
        if z != 0.0 and K.lb[i] < K.ub[i]:
            worst = max(worst, min(abs(z), K.ub[i] - K.x[i]) if z > 0.0 else min(abs(z), K.x[i] - K.lb[i]))
    K.residual_dual = worst / (1.0 + sqrt(size))
    good = K.residual_task <= K.accept and K.residual_bounds <= K.accept and K.residual_dual <= K.accept
    return good


@jit
def command(K: Any) -> None:
    """Integrate x, held for dt, into the command; failed joints exactly as prescribed.

    Acceleration level: q + dt v + dt^2 a/2, v + dt a.  Velocity level: q + dt x, x.
    """
    dt = K.dt
    for i in range(K.n):
        x = K.x[i]
        if K.level == ACCELERATION:
            a = x
            v = K.v[i] + dt * x
            q = K.q[i] + dt * (K.v[i] + 0.5 * dt * x)
        else:
            a = (x - K.v[i]) / dt
            v = x
            q = K.q[i] + dt * x
        fault = K.fault[i]
        if fault == LOCKED:
            a, v, q = 0.0, 0.0, K.q[i]
        elif fault == BRAKING:
            v = K.lock_velocity[i]
        K.a_command[i], K.v_command[i], K.q_command[i] = a, v, q
    if K.has_torques:
        joint_torques(K)


@jit
def joint_torques(K: Any) -> None:
    """tau = M a + h of the command: of the motor for a joint that works, of the brake for a locked one."""
    for i in range(K.n):
        tau = K.h[i]
        for j in range(K.n):
            tau += K.M[i, j] * K.a_command[j]
        fault = K.fault[i]
        K.tau[i] = tau if fault == HEALTHY else 0.0
        K.tau_brake[i] = tau if fault == LOCKED or fault == BRAKING else 0.0
