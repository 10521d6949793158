"""The objective 1/2 x'Hx + g'x: terms whose coefficients add up, so criteria do.

    1/2 norm |x|^2_D + x'D (norm_v v + norm_q (q - posture))          MVN, MAN, RMP
    1/2 inertia x'M x + x'(inertia_v M v + inertia_h h)               MKE, IIWT
    1/2 torque |tau_H|^2                                              MTN, the torque part of DLSM
    - manipulability x' d/dq log sqrt det(J_H J_H')
    1/2 sum_t weight_t |J_t x - b_t|^2                                ``ftqp.kernel.rows.task_terms``

Of an arm that swings beside its target only coming to rest is left, see ``ftqp.kernel.settling.rest``.

x is the acceleration or the velocity. At the velocity level torque is that of the acceleration (x - v)/dt,
times dt. D is the diagonal of joint weights. tau_H and J_H leave out every failed joint: its motor does not
work, and to keep its torque in the objective would change the motion of the others.
Source: docs/theory/schemes.md, which derives the coefficients of every recipe.

A motion of the joints in the place of the task: the QP is as near to it as box and torque rows allow,

    1/2 |x - d|^2 over the joints that work,   d = x_r + kv (v_r - v) + kp (q_r - q)

with x_r the mean acceleration of the motion until the next tick, or at the velocity level its mean velocity,
with kv = 0. Source: docs/theory/ways-to-a-goal.md.
"""

from typing import Any

from ftqp.kernel.arm.kinematics import columns, fold_row, forward_kinematics, mimic_places
from ftqp.kernel.jit import jit, part_jit, rare_jit
from ftqp.kernel.latches.settling import forget_settling
from ftqp.kernel.layout.enums import (
    ACCELERATION,
    FREE,
    HEALTHY,
    TARGET_ACCELERATION,
    TARGET_HAS_ROTATION,
    TARGET_POSE,
    TARGET_TWIST,
    VELOCITY,
)
from ftqp.kernel.maths.elementary import select
from ftqp.kernel.maths.linear_systems import assign, factor, plus_products, solve_factored
from ftqp.kernel.maths.side_by_side import sin_cos
from ftqp.kernel.maths.vectors import ZERO, Vector, column, cross, inner, plus, times
from ftqp.kernel.rows.joint_intervals import draw
from ftqp.kernel.rows.rows_given_up import draw_to_rows
from ftqp.kernel.rows.task_rows import tool_axis
from ftqp.kernel.rows.task_terms import add_terms


@jit
def posture_error(state: Any, criteria: Any, chain: Any, i: int) -> Any:
    """q_i - posture_i; for a continuous joint the short way round, smooth: 2 sin(d/2) sign(cos(d/2))."""
    d = state.q[i] - criteria.posture[i]
    if chain.continuous[i]:
        sine, cosine = sin_cos(0.5 * d)
        return 2.0 * sine * select(cosine >= 0.0, 1.0, -1.0)
    return d


@jit
def draw_to(chain: Any, qp: Any, x: Any) -> None:
    """The objective of x - x_0 in place of x, g -= H x_0; x_0 is 0 for failed joints."""
    n = chain.n
    for i in range(n):
        if qp.dense:
            for j in range(n):
                qp.g[i] -= qp.H[i, j] * x[j]
        else:
            qp.g[i] -= qp.H_diagonal[i] * x[i]


@part_jit
def objective(K: Any) -> None:
    """H and g of the joints; H_diagonal alone when no criterion couples joints."""
    state, criteria, qp = K.state, K.criteria, K.qp
    qp.dense = 0
    for i in range(K.chain.n):
        qp.H_diagonal[i] = criteria.norm * criteria.weight[i]
        qp.g[i] = criteria.weight[i] * criteria.norm_v * state.v[i]
        if criteria.norm_q != 0.0:
            qp.g[i] += criteria.weight[i] * criteria.norm_q * posture_error(state, criteria, K.chain, i)
    if (
        criteria.inertia != 0.0
        or criteria.inertia_v != 0.0
        or criteria.inertia_h != 0.0
        or criteria.torque != 0.0
    ):
        _couple(K)
    if K.terms.count:
        if K.task.given_up:
            draw_to_rows(K)
        add_terms(K)
    if K.settling.gradient_suppressed:
        _hush(K)


@jit
def _couple(K: Any) -> None:
    """The terms of H and g that couple joints."""
    chain, faults, state, kinematics, criteria, qp, scratch = (
        K.chain,
        K.faults,
        K.state,
        K.kinematics,
        K.criteria,
        K.qp,
        K.scratch,
    )
    n = chain.n
    qp.dense = 1
    h_scale = state.dt if state.level == VELOCITY else 1.0
    for i in range(n):
        momentum = 0.0
        for j in range(n):
            qp.H[i, j] = criteria.inertia * kinematics.M[i, j]
            momentum += kinematics.M[i, j] * state.v[j]
        qp.H[i, i] += qp.H_diagonal[i]
        qp.g[i] += criteria.inertia_v * momentum + criteria.inertia_h * h_scale * kinematics.h[i]
        scratch.joints[i] = h_scale * kinematics.h[i] - (momentum if state.level == VELOCITY else 0.0)
    if criteria.torque == 0.0:
        return
    for k in range(n):
        if faults.code[k] == HEALTHY:
            for i in range(n):
                c = criteria.torque * kinematics.M[k, i]
                qp.g[i] += c * scratch.joints[k]
                for j in range(i + 1):
                    qp.H[i, j] += c * kinematics.M[k, j]
        elif faults.code[k] == FREE:
            # torque/2 (row x - right side)^2 of its equality row: zero for every x that is allowed, so it
            # changes no answer, and it keeps H > 0, as the row's own torque would
            for i in range(n):
                c = criteria.torque * qp.C[k, i]
                qp.g[i] -= c * qp.l[k]
                for j in range(i + 1):
                    qp.H[i, j] += c * qp.C[k, j]
    for i in range(n):
        assign(qp.H[:, i], qp.H[i], i)


@rare_jit
def _hush(K: Any) -> None:
    """The objective of an arm that has swung: 1/2 (x + kv v)'H (x + kv v), or 1/2 x'H x of velocities."""
    state, task, qp, n = K.state, K.task, K.qp, K.chain.n
    kv = task.kv if state.level == ACCELERATION else 0.0
    for i in range(n):
        momentum = plus_products(0.0, qp.H[i], state.v, n) if qp.dense else qp.H_diagonal[i] * state.v[i]
        qp.g[i] = kv * momentum


DRIVE_GAIN = 4.0
"""How fast the null-space velocity approaches the drive at least, where it is a state [1/s]."""


@jit
def add_drive(K: Any, path: Any) -> None:
    """The objective of x - x_0 in place of x, g -= H x_0: the null space is drawn to the velocity ``drive``.

    Velocity level: x_0 = drive, or DRIVE_GAIN dt (drive - v) where the scheme keeps the last velocity.
    Acceleration level: x_0 = gain drive - (gain - own) v, own the velocity gain that the scheme has already
    and gain = max(DRIVE_GAIN, own).
    """
    faults, state, criteria, scratch = K.faults, K.state, K.criteria, K.scratch
    own = 0.0
    if criteria.norm > 0.0:
        own = criteria.norm_v / criteria.norm
    elif criteria.inertia > 0.0:
        own = criteria.inertia_v / criteria.inertia
    gain = max(DRIVE_GAIN, own)
    keeps = own < 0.0 or (criteria.norm == 0.0 and criteria.inertia == 0.0)
    for i in range(K.chain.n):
        x = path.drive[i]
        if state.level != VELOCITY:
            x = gain * x - (gain - own) * state.v[i]
        elif keeps:
            x = DRIVE_GAIN * state.dt * (x - state.v[i])
        scratch.joints[i] = x if faults.code[i] == HEALTHY else 0.0
    draw_to(K.chain, K.qp, scratch.joints)


FLOOR = 0.01
"""Singular values below FLOOR lengths count as about that, so that the gradient stays finite."""


@jit
def _along_rows(task: Any, kinematics: Any, scratch: Any) -> tuple[Vector, Vector]:
    """The force and the moment along W that the row coefficients in scratch stand for."""
    f = m = ZERO
    for k in range(task.m):
        c = task.rows[k]
        s = task.row_scale[c] * scratch.rows[k]
        one = (s if c % 3 == 0 else 0.0, s if c % 3 == 1 else 0.0, s if c % 3 == 2 else 0.0)
        if c < 3:
            f = plus(f, one)
        elif not task.tool_rows:
            m = plus(m, one)
        else:
            m = plus(m, times(s, tool_axis(task, kinematics, c - 3)))
    return f, m


@jit
def manipulability_gradient(K: Any) -> None:
    """d/dq_i log sqrt det S, S = A_f A_f' + (FLOOR length)^2 I, = sum_j (dA_j/dq_i)' S^-1 A_j, into scratch.

    A_f are the columns of the working joints j. With column (v_j; w_j) of the geometric Jacobian, w_j = 0 for
    a prismatic joint,

        d/dq_i (v_j; w_j) = (w_i x v_j; w_i x w_j)  for i <= j,   (w_j x v_i; 0)  for i > j;

    with rows along the tool's axes the angular part is 0 and w_j x w_i instead. It needs ``task_rows``, not
    turned.
    Source: Yoshikawa 1985 for the measure; its floor keeps the gradient finite at a singularity.
    """
    chain, faults, kinematics, task, qp, scratch = K.chain, K.faults, K.kinematics, K.task, K.qp, K.scratch
    n, m = chain.n, task.m
    S, gradient, J = scratch.square, scratch.joints, columns(kinematics, chain)
    for a in range(m):
        for b in range(m):
            s = 0.0
            for k in range(faults.working):
                j = faults.order[k]
                s += qp.A[a, j] * qp.A[b, j]
            S[a, b] = s
        S[a, a] += (FLOOR * task.length) ** 2
    gradient[:n] = 0.0
    if not factor(S, m):
        return
    for a in range(faults.working):
        j = faults.order[a]
        for k in range(m):
            scratch.rows[k] = chain.ratio[j] * qp.A[k, chain.lead[j]]
        solve_factored(S, m, scratch.rows)
        f, moment = _along_rows(task, kinematics, scratch)
        v, w = column(J, 0, j), column(J, 3, j)
        for i in range(n):
            x = y = ZERO
            u = column(J, 3, i)
            if i > j:
                x = cross(w, column(J, 0, i))
                if task.tool_rows and not chain.prismatic[i]:
                    y = cross(w, u)
            elif not chain.prismatic[i]:
                x = cross(u, v)
                if not task.tool_rows:
                    y = cross(u, w)
            gradient[i] += inner(f, x) + inner(moment, y)
    if chain.mimics:
        fold_row(chain, gradient)


@part_jit
def add_manipulability(K: Any) -> None:
    """g -= gain d/dq log w: with |x|^2/2 beside it, x is drawn towards gain times the gradient."""
    chain, criteria, qp, scratch = K.chain, K.criteria, K.qp, K.scratch
    manipulability_gradient(K)
    for i in range(chain.n):
        qp.g[i] -= criteria.manipulability * scratch.joints[i]


FREE_WEIGHT = 1e-6
"""Weight of a free-swinging joint, which others are not to hold still; H stays positive definite. Six digits
below the others' weight, 1, so that it costs them nothing that shows."""


@jit
def aim_at_reference(K: Any, joints: Any) -> None:
    """The target of the tip: where it would be if every joint that works were on the motion."""
    chain, state, supposed, kinematics, target = K.chain, K.state, K.supposed, K.kinematics, K.task.target
    for i in range(chain.n):
        supposed.q[i] = joints.q[i] if K.faults.code[i] == HEALTHY else state.q[i]
    if chain.mimics:
        mimic_places(chain, supposed.q)
    forward_kinematics(K, supposed)
    for r in range(3):
        for c in range(3):
            target[TARGET_POSE + 4 * r + c] = kinematics.R_tip[3 * r + c]
        target[TARGET_POSE + 4 * r + 3] = kinematics.o_tip[r]
    target[TARGET_TWIST : TARGET_ACCELERATION + 6] = 0.0
    target[TARGET_HAS_ROTATION] = 1.0
    forward_kinematics(K, state)


@jit
def joint_objective(K: Any, joints: Any) -> None:
    """H and g of the joints, no rows of the task; nothing is held that the task had held."""
    chain, faults, state, task, qp = K.chain, K.faults, K.state, K.task, K.qp
    forget_settling(K.settling)
    K.settling.entered = 0
    for i in range(chain.n):
        demand = joints.x[i] + joints.kv * (joints.v[i] - state.v[i]) + joints.kp * (joints.q[i] - state.q[i])
        joints.demand[i] = demand if faults.code[i] == HEALTHY else 0.0
        draw(qp, i, FREE_WEIGHT if faults.code[i] == FREE else 1.0, joints.demand[i])
    for k in range(task.m):
        task.slack[k] = task.asked[k] = 0.0
    qp.nx, qp.meq, qp.dense, qp.warm = chain.n, 0, 0, 0
    qp.soft[0] = 1.0
    task.beyond = 0.0
