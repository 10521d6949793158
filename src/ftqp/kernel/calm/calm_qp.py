"""A tick in calm: whether the error bends more than the rows can hold, and the QP that then takes over."""

from math import sqrt
from typing import Any

from ftqp.kernel.calm.brake import braked, feedback_rate, way_to_go
from ftqp.kernel.calm.curvature import curvature, weigh_rows
from ftqp.kernel.calm.metric import find_metric
from ftqp.kernel.calm.rest import decide, watch_target
from ftqp.kernel.calm.swing import gives_up, watch_swing
from ftqp.kernel.calm.trigger import is_regular
from ftqp.kernel.jit import jit, part_jit, rare_jit
from ftqp.kernel.latches.settling import NO_METRIC, REGULAR, settle
from ftqp.kernel.layout.enums import ACCELERATION, SCALE
from ftqp.kernel.layout.thresholds import LAST
from ftqp.kernel.rows.task_rows import softness
from ftqp.kernel.rows.task_terms import share


@part_jit
def calms(K: Any, kp: float) -> bool:
    """Whether the curvature of the error takes part in this tick: D, the kick, beta and the hold.

    It needs ``objective`` and ``task_rows``; kp is their gain on the error.
    """
    calm = K.calm
    if not calm.on or kp == 0.0:  # without feedback the error asks for nothing
        return False
    watch_target(K.state, K.faults, K.task, calm)
    watch_swing(K)
    if not calm.holding and not gives_up(calm) and is_regular(K):
        settle(calm, REGULAR, K.state.dt)
        return False
    return _takes_part(K, kp)


@rare_jit
def _takes_part(K: Any, kp: float) -> bool:
    """The same where the curvature may matter: the metric, the way to go and the pace of the feedback."""
    calm = K.calm
    square = weigh_rows(K.task, K.kinematics, K.chain, K.qp, calm)
    s = curvature(K.faults, K.task, K.kinematics, K.chain, calm)
    calm.soft = softness(K.task, K.terms, K.chain, K.qp, K.task.slack_ratio)
    if not s > calm.soft:  # no direction is stiffer than the feedback then
        settle(calm, REGULAR, K.state.dt)
        return False
    count = find_metric(K, s, square)
    if count < 0:
        settle(calm, NO_METRIC, K.state.dt)
        return False
    calm.count = count
    calm.rho = way_to_go(K.task, calm, count, calm.soft)
    decide(K, square)
    calm.beta = (
        0.0 if calm.holding else braked(K.limits, calm, count, feedback_rate(K.state, K.task, kp), square)
    )
    return True


@jit
def _lean(state: Any, faults: Any, limits: Any, qp: Any, calm: Any, kp: float, kv: float) -> None:
    """A joint that the gradient presses against its range goes to its limit at the pace of the feedback.

    The full demand, which the range forbids, would bring it there at its acceleration limit. With
    w = beta kp d - kv v over those joints, d the way to the limit, psi blends in

        H_FB <- 0,  g_F <- g_F + H_FB w,  g_B <- - H_BB w,

    so that x_B = w, and the free joints know of it.
    """
    psi = calm.psi
    for a in range(calm.count, faults.working):
        i = calm.free[a]
        way = (limits.q_max[i] if calm.gradient[i] > 0.0 else limits.q_min[i]) - state.q[i]
        calm.delta[a] = calm.beta * kp * way - kv * state.v[i]
    for a in range(faults.working):
        i = calm.free[a]
        g = 0.0
        for b in range(calm.count, faults.working):
            j = calm.free[b]
            g += qp.H[i, j] * calm.delta[b]
            if a < calm.count:
                qp.H[i, j] *= 1.0 - psi
                qp.H[j, i] = qp.H[i, j]
        qp.g[i] += psi * g if a < calm.count else -psi * (g + qp.g[i])


@rare_jit
def begin_calm(K: Any, kp: float) -> None:
    """The QP of calm, without rows of the task: they are in its objective.

        acceleration   min soft f(x) + 1/2 |A x - b|^2 + 1/2 (x + kv v)' D (x + kv v)
        velocity       min soft f(x) + 1/2 |A x - b|^2 + 1/2 x' D x

    f is the scheme's objective, soft the compliance of the rows, b their right side with beta (e + kick) in
    place of the error.
    """
    task, qp = K.task, K.qp
    for k in range(task.m):
        task.asked[k] = qp.b[k] - (qp.A[k, K.chain.n] if task.mode == SCALE else 0.0)
    qp.nx = K.chain.n
    pose_calm(K, kp)


@jit
def pose_calm(K: Any, kp: float) -> None:
    """The same over the joints, from what ``task.asked`` says of the rows."""
    chain, state, task, calm, qp = K.chain, K.state, K.task, K.calm, K.qp
    n, m = chain.n, task.m
    qp.soft_last = LAST
    if K.terms.shared:
        share(K, 1.0 / calm.soft)
    kv = task.kv if state.level == ACCELERATION else 0.0
    for k in range(m):
        w = 1.0 / sqrt(task.yielding[task.rows[k]])
        calm.b[k] = w * task.asked[k] - (1.0 - calm.beta) * kp * calm.e[k]
    if qp.dense == 0:
        for i in range(n):
            for j in range(n):
                qp.H[i, j] = 0.0
            qp.H[i, i] = qp.H_diagonal[i]
    for i in range(n):
        g = calm.soft * qp.g[i]
        for k in range(m):
            g -= calm.A[k, i] * calm.b[k]
        for j in range(n):
            g += kv * calm.D[i, j] * state.v[j]
        qp.g[i] = g - calm.beta * kp * calm.kick[i]
        for j in range(i + 1):
            s = calm.soft * qp.H[i, j] + calm.D[i, j]
            for k in range(m):
                s += calm.A[k, i] * calm.A[k, j]
            qp.H[i, j] = qp.H[j, i] = s
    _lean(state, K.faults, K.limits, qp, calm, kp, kv)
    qp.dense = 1
    qp.meq = 0
    if calm.entered == 0:
        qp.warm = 0
    calm.entered = 1
