"""What an answer is worth and what it commands: residuals, clamp, integration."""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.arm.mimicry import mimic, mimic_places
from ftqp.kernel.arm.newton_euler import torques_of
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.judge.kept_limits import torque_excess
from ftqp.kernel.layout.enums import ACCELERATION, BRAKING, HEALTHY, LOCKED
from ftqp.kernel.maths.elementary import select
from ftqp.kernel.maths.finite import is_finite
from ftqp.kernel.maths.side_by_side import WIDTH, below, put, several


@jit
def check_solution(task: Any, cascade: Any, qp: Any, scratch: Any) -> bool:
    """Clamp x into the box, recompute every residual, and say whether the answer counts as solved.

    residual_task: max |A x + s - b| with s = soft lam, over 1 + max |b|; residual_bounds: what the rows of C
    are violated by, over 1 + max |x|; residual_dual: max |Hx + g + A'y + C'z + z_box|, over 1 + the norm of
    its terms. Wrong signs of multipliers count into residual_dual.
    """
    n, m = qp.nx, qp.meq
    size_x = 0.0
    for i in range(n):
        x = min(max(qp.x[i], qp.lb[i]), qp.ub[i])
        if not is_finite(x):
            cascade.residual_bounds = inf
            return False
        qp.x[i] = x
        size_x = max(size_x, abs(x))
    worst, size = 0.0, 0.0
    for k in range(m):
        s = -qp.b[k]
        for i in range(n):
            s += qp.A[k, i] * qp.x[i]
        size = max(size, abs(qp.b[k]))
        worst = max(worst, abs(s - qp.soft[k] * qp.y[k]))
        task.slack[k] = s + qp.b[k] - task.asked[k]
    cascade.residual_task = worst / (1.0 + size)
    worst = 0.0
    for j in range(qp.nc):
        if qp.l[j] == -inf and qp.u[j] == inf:
            continue
        s = 0.0
        for i in range(n):
            s += qp.C[j, i] * qp.x[i]
        over = max(qp.l[j] - s, s - qp.u[j])
        if qp.soft_rows > 0.0 and (qp.l[j] < qp.u[j] or j >= qp.rigid):
            over = 0.0
        if qp.soft_last > 0.0 and j >= qp.yields_from:
            over = 0.0
        worst = max(worst, over)
    cascade.residual_bounds = worst / (1.0 + size_x)
    r = scratch.joints
    size = 0.0
    for i in range(n):
        r[i] = qp.g[i]
        size += r[i] * r[i]
    if qp.dense:
        for i in range(n):
            s = 0.0
            for j in range(n):
                s += qp.H[i, j] * qp.x[j]
            r[i] += s
            size += s * s
    else:
        for i in range(n):
            s = qp.H_diagonal[i] * qp.x[i]
            r[i] += s
            size += s * s
    for k in range(m):
        y = qp.y[k]
        for i in range(n):
            s = qp.A[k, i] * y
            r[i] += s
            size += s * s
    for k in range(qp.nc):
        y = qp.z[k]
        if y != 0.0:
            for i in range(n):
                s = qp.C[k, i] * y
                r[i] += s
                size += s * s
    worst = 0.0
    for i in range(n):
        z = qp.z_box[i]
        if not is_finite(r[i] + z):  # max would lose a NaN
            cascade.residual_dual = inf
            return False
        worst = max(worst, abs(r[i] + z))
        if z != 0.0 and qp.lb[i] < qp.ub[i]:
            worst = max(
                worst, min(abs(z), qp.ub[i] - qp.x[i]) if z > 0.0 else min(abs(z), qp.x[i] - qp.lb[i])
            )
    cascade.residual_dual = worst / (1.0 + sqrt(size))
    good = (
        cascade.residual_task <= cascade.accept
        and cascade.residual_bounds <= cascade.accept
        and cascade.residual_dual <= cascade.accept
    )
    return good


@jit
def command(K: Any) -> None:
    """Integrate x, held for dt, into the command; failed joints, and those that mimic others, exactly.

    Acceleration level: q + dt v + dt^2 a/2, v + dt a.  Velocity level: q + dt x, x.
    """
    chain, faults, state, kinematics, qp = K.chain, K.faults, K.state, K.kinematics, K.qp
    dt = state.dt
    for at in range(0, K.chain.n, WIDTH):
        x, q, v = several(qp.x, at), several(state.q, at), several(state.v, at)
        x = select(below(chain.n, at), x, 0.0)
        is_acceleration = state.level == ACCELERATION
        put(state.a_command, at, x if is_acceleration else (x - v) / dt)
        put(state.v_command, at, v + dt * x if is_acceleration else x)
        put(state.q_command, at, q + dt * (v + 0.5 * dt * x) if is_acceleration else q + dt * x)
    for k in range(faults.movable, chain.n):
        i = faults.order[k]
        if faults.code[i] == LOCKED:
            state.a_command[i], state.v_command[i], state.q_command[i] = 0.0, 0.0, state.q[i]
        elif faults.code[i] == BRAKING:
            state.v_command[i] = faults.lock_velocity[i]
    if chain.mimics:
        mimic(chain, state.a_command)
        mimic(chain, state.v_command)
        mimic_places(chain, state.q_command)
    if kinematics.has_dynamics:
        joint_torques(state, faults, kinematics, chain)
        K.cascade.torque_excess = torque_excess(K)


@jit
def joint_torques(state: Any, faults: Any, kinematics: Any, chain: Any) -> None:
    """tau = M a + h of the command: of the motor for a joint that works, of the brake for a locked one."""
    for i in range(chain.n):
        tau = kinematics.h[i]
        for j in range(chain.n):
            tau += kinematics.M[i, j] * state.a_command[j]
        _carry(state, faults, i, tau if chain.lead[i] == i else 0.0)


@jit
def _carry(state: Any, faults: Any, i: int, tau: float) -> None:
    """Give the torque of a joint to its motor, or to its brake; a free-swinging joint has neither."""
    fault = faults.code[i]
    state.tau[i] = tau if fault == HEALTHY else 0.0
    state.tau_brake[i] = tau if fault == LOCKED or fault == BRAKING else 0.0


@part_jit
def torques_without_inertia(K: Any) -> None:
    """The same of a tick that did without M and h; needs ``motion``."""
    torques_of(K.state, K.kinematics, K.chain, K.state.a_command)
    for i in range(K.chain.n):
        _carry(K.state, K.faults, i, K.kinematics.tau[i])
    K.kinematics.has_dynamics = 1  # as far as torques are concerned
