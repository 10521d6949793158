"""The objective 1/2 x'Hx + g'x: terms whose coefficients add up, so criteria do.

    1/2 norm |x|^2_D + x'D (norm_v v + norm_q (q - posture))          MVN, MAN, RMP
    1/2 inertia x'M x + x'(inertia_v M v + inertia_h h)               MKE, IIWT
    1/2 torque |tau_H|^2                                              MTN, the torque part of DLSM
    - manipulability x' d/dq log sqrt det(J_H J_H')                   ``ftqp.kernel.rows.manipulability``
    1/2 sum_t weight_t |J_t x - b_t|^2                                ``ftqp.kernel.rows.task_terms``
    - x'H sway                                                        small motions that only serve to tell

Of an arm that swings beside its target only coming to rest is left, see ``ftqp.kernel.calm.swing``.

x is the acceleration or the velocity. At the velocity level torque is that of the acceleration (x - v)/dt,
times dt. D is the diagonal of joint weights. tau_H and J_H leave out every failed joint: its motor does not
work, and to keep its torque in the objective would change the motion of the others.
Source: docs/theory/schemes.md, which derives the coefficients of every recipe.
"""

from typing import Any

from ftqp.kernel.jit import jit, part_jit, rare_jit
from ftqp.kernel.layout.enums import ACCELERATION, FREE, HEALTHY, VELOCITY
from ftqp.kernel.maths.elementary import select
from ftqp.kernel.maths.trigonometry import sin_cos
from ftqp.kernel.rows.rows_given_up import draw_to_rows
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
    if K.calm.hushed:
        _hush(K)
    if criteria.sways:
        draw_to(K.chain, qp, criteria.sway)


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
        for j in range(i):
            qp.H[j, i] = qp.H[i, j]


@rare_jit
def _hush(K: Any) -> None:
    """The objective of an arm that has swung: 1/2 (x + kv v)'H (x + kv v), or 1/2 x'H x of velocities."""
    state, task, qp, n = K.state, K.task, K.qp, K.chain.n
    kv = task.kv if state.level == ACCELERATION else 0.0
    for i in range(n):
        if qp.dense:
            momentum = 0.0
            for j in range(n):
                momentum += qp.H[i, j] * state.v[j]
        else:
            momentum = qp.H_diagonal[i] * state.v[i]
        qp.g[i] = kv * momentum
