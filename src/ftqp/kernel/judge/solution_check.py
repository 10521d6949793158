"""What an answer is worth and what it commands: residuals, clamp, integration.

The assembled QP in the standard form that external solvers take, and their answer back.

The compliance of a task row becomes a slack variable t with A x + sqrt(soft h) t = b and cost h t^2/2, where
h is the mean diagonal of H: this is the same problem, scaled so that a first-order method is not hurt. The
variables are the joints, the path scale (in scaled mode) and the slacks (in every mode but hard); the rows of
C are those of ``ftqp.kernel.layout.rows``. Sizes never change in a planner's life.
"""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.arm.dynamics import torques_of
from ftqp.kernel.arm.kinematics import mimic, mimic_places
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import ACCELERATION, BRAKING, FREE, HARD, HEALTHY, LOCKED, SCALE
from ftqp.kernel.layout.thresholds import NEARER, OUTSIDE_FROM
from ftqp.kernel.maths.elementary import any_of, is_finite, select
from ftqp.kernel.maths.linear_systems import plus_products
from ftqp.kernel.maths.side_by_side import WIDTH, is_set, lane_mask, load_lanes, store_lanes


@jit
def is_beyond_range(K: Any, i: int) -> bool:
    """Whether joint i is beyond its range as believed, a failed one beyond its healthy range."""
    limits, q = K.limits, K.state.q[i]
    return bool(q < limits.q_min[i] - OUTSIDE_FROM or q > limits.q_max[i] + OUTSIDE_FROM)


@jit
def is_too_fast(K: Any, i: int) -> bool:
    """Whether joint i moves faster than its limit as believed."""
    return bool(abs(K.state.v[i]) > K.limits.v_max[i] * (1.0 + OUTSIDE_FROM))


@jit
def joints_outside(K: Any) -> int:
    """How many joints are beyond their range, or work and are faster than their limit."""
    limits, faults, state = K.limits, K.faults, K.state
    count = 0
    for at in range(0, K.chain.n, WIDTH):
        q, v = load_lanes(state.q, at), load_lanes(state.v, at)
        beyond = (q < load_lanes(limits.q_min, at) - OUTSIDE_FROM) | (
            q > load_lanes(limits.q_max, at) + OUTSIDE_FROM
        )
        fast = abs(v) > load_lanes(limits.v_max, at) * (1.0 + OUTSIDE_FROM)
        if any_of(beyond | (fast & ~is_set(faults.code, at))):
            for i in range(at, min(at + WIDTH, K.chain.n)):
                if is_beyond_range(K, i) or (faults.code[i] == HEALTHY and is_too_fast(K, i)):
                    count += 1
    return count


@jit
def too_near(K: Any) -> int:
    """Whether bodies are nearer than they are to be kept, or more pairs are near than have rows."""
    scene = K.scene
    return 1 if scene.pairs > 0 and (scene.crowded or scene.distance < scene.keep - NEARER) else 0


@jit
def torque_excess(K: Any) -> float:
    """By how much the command breaks what is believed of the motors [N m or N], over all joints."""
    chain, faults, limits, state, kinematics = K.chain, K.faults, K.limits, K.state, K.kinematics
    worst = 0.0
    for i in range(chain.n):
        if faults.code[i] == HEALTHY:
            worst = max(worst, abs(state.tau[i]) - limits.tau_max[i])
        elif faults.code[i] == FREE and not K.free.contact[i]:
            v = state.v_command[i]
            tau = kinematics.h[i] + faults.friction[i] * v + chain.viscous[i] * (v - state.v[i])
            tau = plus_products(tau, kinematics.M[i], state.a_command, chain.n)
            worst = max(worst, abs(tau) - faults.coulomb[i])
    return worst


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
        s = plus_products(-qp.b[k], qp.A[k], qp.x, n)
        size = max(size, abs(qp.b[k]))
        worst = max(worst, abs(s - qp.soft[k] * qp.y[k]))
        task.slack[k] = s + qp.b[k] - task.asked[k]
    cascade.residual_task = worst / (1.0 + size)
    worst = 0.0
    for j in range(qp.nc):
        if qp.l[j] == -inf and qp.u[j] == inf:
            continue
        s = plus_products(0.0, qp.C[j], qp.x, n)
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
            s = plus_products(0.0, qp.H[i], qp.x, n)
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
        x, q, v = load_lanes(qp.x, at), load_lanes(state.q, at), load_lanes(state.v, at)
        x = select(lane_mask(chain.n, at), x, 0.0)
        is_acceleration = state.level == ACCELERATION
        store_lanes(state.a_command, at, x if is_acceleration else (x - v) / dt)
        store_lanes(state.v_command, at, v + dt * x if is_acceleration else x)
        store_lanes(state.q_command, at, q + dt * (v + 0.5 * dt * x) if is_acceleration else q + dt * x)
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
        tau = plus_products(kinematics.h[i], kinematics.M[i], state.a_command, chain.n)
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


@jit
def sizes(task: Any, cascade: Any, chain: Any) -> tuple[int, int, int]:
    """Variables, equality rows and two-sided rows of the external QP."""
    variables = chain.n + (1 if task.mode == SCALE else 0) + (0 if task.mode == HARD else task.m)
    return variables, task.m, cascade.p


@jit
def packed_size(task: Any, cascade: Any, chain: Any) -> int:
    """Numbers that ``pack`` writes."""
    n, m, p = sizes(task, cascade, chain)
    return n * n + n + (m + p) * n + 2 * (n + m + p)


@jit
def solution_size(task: Any, cascade: Any, chain: Any) -> int:
    """Numbers that ``unpack`` reads."""
    n, m, p = sizes(task, cascade, chain)
    return 2 * n + m + p


@jit
def pack(task: Any, cascade: Any, chain: Any, qp: Any, flat: Any) -> None:
    """Write H, g, A, C, lb, b, l, ub, b, u one after the other, matrices by rows, into ``flat``."""
    n, m, p = sizes(task, cascade, chain)
    nx = qp.nx
    mean = 0.0
    for i in range(chain.n):
        mean += qp.H[i, i] if qp.dense else qp.H_diagonal[i]
    mean /= chain.n
    at = 0
    for i in range(nx):
        if qp.dense:
            for j in range(nx):
                flat[at + j] = qp.H[i, j]
        else:
            for j in range(nx):
                flat[at + j] = 0.0
            flat[at + i] = qp.H_diagonal[i]
        at += n
    for i in range(nx, n):
        flat[at + i] = mean
        at += n
    for i in range(n):
        flat[at + i] = qp.g[i] if i < nx else 0.0
    at += n
    for k in range(m):
        for i in range(nx):
            flat[at + i] = qp.A[k, i]
        if n > nx:
            flat[at + nx + k] = sqrt(qp.soft[k] * mean)
        at += n
    for j in range(p):
        for i in range(chain.n):
            flat[at + i] = qp.C[j, i] if j < qp.nc else 0.0
        at += n
    k = n + m + p
    for i in range(n):
        flat[at + i] = qp.lb[i] if i < nx else -inf
        flat[at + k + i] = qp.ub[i] if i < nx else inf
    at += n
    for i in range(m):
        flat[at + i] = flat[at + k + i] = qp.b[i]
    at += m
    for j in range(p):
        flat[at + j] = qp.l[j] if j < qp.nc else -inf
        flat[at + k + j] = qp.u[j] if j < qp.nc else inf


@jit
def unpack(task: Any, cascade: Any, chain: Any, qp: Any, flat: Any) -> None:
    """Read x, z_box, y, z, one after the other in ``flat``, back into the record."""
    n, m, _ = sizes(task, cascade, chain)
    for i in range(qp.nx):
        qp.x[i] = flat[i]
        qp.z_box[i] = flat[n + i]
    for k in range(m):
        qp.y[k] = flat[2 * n + k]
    for j in range(qp.nc):
        qp.z[j] = flat[2 * n + m + j]
