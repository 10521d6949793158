"""A tick in calm: whether the error bends more than the rows can hold, and the QP that then takes over."""

from math import sqrt
from typing import Any

from ftqp.kernel.calm.curvature import curvature, spread, weigh_rows
from ftqp.kernel.calm.metric import find_metric
from ftqp.kernel.calm.rest import (
    braked,
    decide,
    feedback_rate,
    gives_up,
    watch_swing,
    watch_target,
    way_to_go,
)
from ftqp.kernel.calm.trigger import is_regular
from ftqp.kernel.jit import jit, part_jit, rare_jit
from ftqp.kernel.latches.settling import NO_METRIC, REGULAR, settle
from ftqp.kernel.layout.enums import ACCELERATION, SCALE, TARGET_HAS_ROTATION, TARGET_TWIST
from ftqp.kernel.layout.thresholds import LAST
from ftqp.kernel.maths.linear_systems import factor, solve_factored
from ftqp.kernel.rows.path_rows import LEAST_IN_CALM
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


APPROACHES = 6.0
"""At the velocity level joints and rate go to what they wait for with so many times the gain of the error. 4
is critically damped and slow, and with 8 a path near a singularity jolted
(tests/robustness/test_found_by_campaigns.py)."""
SLOW = 0.5
"""Rate of a path below which its ticks may be posed in calm. Faster paths are posed as if there were no calm
(docs/theory/calm.md, "Paths that wait")."""


@jit
def waits(K: Any, path: Any) -> bool:
    """Whether the path is slow, blocked or at its end; the others never pay for calm."""
    return bool(path.rate < SLOW or path.limit == 0.0 or path.progress >= path.end)


@jit
def stand_still(task: Any, calm: Any, path: Any) -> bool:
    """The target of a blocked path stands where it is, without twist and acceleration; whether it does."""
    if path.limit > 0.0 or not calm.on:
        return False
    for k in range(TARGET_TWIST, TARGET_HAS_ROTATION):
        task.target[k] = 0.0
    return True


@jit
def leave_calm(qp: Any, calm: Any) -> None:
    """The codes of a working set depend on how many rows there are: after a tick in calm it is of no use."""
    if calm.entered:
        calm.entered, qp.warm = 0, 0


@jit
def set_in_at_zero(faults: Any, task: Any, chain: Any, calm: Any) -> None:
    """D <- D psi_t/psi, and the kick: a metric that begins with a step where it begins is 0 there.

        psi_t = max(0, 1 - sigma_min^2/t),  t = (tr S^4)^(1/4)

    A path would take turns at that step: it waits for what D holds back, and leaves D as it waits. It needs
    ``find_metric``.
    """
    least = calm.squares[0] if calm.count > 0 else 0.0
    for k in range(1, task.m):
        least = min(least, calm.squares[k])
    psi = max(0.0, 1.0 - max(least, 0.0) / spread(chain, calm))
    if not psi < calm.psi:
        return
    share, calm.psi = psi / calm.psi, psi
    for a in range(faults.working):
        i = faults.order[a]
        calm.kick[i] *= share
        for b in range(faults.working):
            calm.D[i, faults.order[b]] *= share


@rare_jit
def begin_calm_on_path(K: Any, path: Any, kp: float) -> None:
    """The QP of calm with the path rate as the last variable: A x - x' s - b in place of A x - b.

    Where the null space is drawn to a velocity, D acts on what differs from it. It needs ``rate_variable``,
    with the compliance of calm.
    Source: docs/theory/calm.md, "Paths that wait".
    """
    state, task, calm, qp = K.state, K.task, K.calm, K.qp
    n = K.chain.n
    weight = calm.soft * qp.H[n, n]
    s, g = weight, calm.soft * qp.g[n]
    for k in range(task.m):
        task.asked[k] = qp.b[k]
    if state.level != ACCELERATION:
        set_in_at_zero(K.faults, task, K.chain, calm)
    pose_calm(K, kp)
    for k in range(task.m):
        calm.rate[k] = qp.A[k, n] / sqrt(task.yielding[task.rows[k]])
        s += calm.rate[k] * calm.rate[k]
        g -= calm.rate[k] * calm.b[k]
    for i in range(n):
        along = 0.0
        for k in range(task.m):
            along += calm.A[k, i] * calm.rate[k]
        qp.H[i, n] = qp.H[n, i] = along
    for a in range(calm.count, K.faults.working):  # pressed against their range, as in ``pose_calm``
        i = calm.free[a]
        g += calm.psi * qp.H[n, i] * calm.delta[a]
        qp.H[i, n] = qp.H[n, i] = (1.0 - calm.psi) * qp.H[n, i]
    qp.H[n, n] = qp.H_diagonal[n] = s
    qp.g[n] = g
    if path.driven:
        kv = task.kv if state.level == ACCELERATION else 1.0
        for i in range(n):
            for j in range(n):
                qp.g[i] -= kv * calm.D[i, j] * path.drive[j]
    _hold_rate(K.faults, K.chain, qp, calm, path, weight)
    if state.level != ACCELERATION and calm.count == K.faults.working:
        _approach(state, task, K.chain, qp, calm, path, kp)


@jit
def _approach(state: Any, task: Any, chain: Any, qp: Any, calm: Any, path: Any, kp: float) -> None:
    """Velocity level: in a tick joints and rate go a share of the way to the optimum, which does not swing.

        g <- c g - (1 - c) (H (v, s') + (A, -x')'(x'' s'^2 - Jdot v) dt)
        c = APPROACHES kp dt/(1 + APPROACHES kp dt)

    Not where a joint is pressed against its range: there the path has to stop at once, or the tip leaves it.
    s' is the last rate. The last term is what the rows of the motion (v, s') change by in a tick.
    Source: docs/theory/calm.md, "Paths that wait".
    """
    n, near = chain.n, 1.0 / (1.0 + APPROACHES * kp * state.dt)
    own = max(path.rate, LEAST_IN_CALM)
    for i in range(n + 1):
        x = qp.H[i, n] * path.rate
        for j in range(n):
            x += qp.H[i, j] * state.v[j]
        for k in range(task.m):
            row = calm.rate[k] if i == n else calm.A[k, i]
            x += row * own * own * path.bend[k] * state.dt / sqrt(task.yielding[task.rows[k]])
        qp.g[i] = (1.0 - near) * qp.g[i] - near * x


@jit
def _hold_rate(faults: Any, chain: Any, qp: Any, calm: Any, path: Any, weight: float) -> None:
    """Where D < 0 along what s moves, add to 1/2 (s - sigma')^2 what keeps the QP convex.

    What is left for s when the joints follow, H_ss - h'H^-1 h, becomes ``weight`` at least.
    """
    n, w, W, x = chain.n, faults.working, calm.work, calm.beside
    for a in range(w):
        i = faults.order[a]
        x[a] = qp.H[i, n]
        for b in range(a + 1):
            W[a, b] = qp.H[i, faults.order[b]]
    if w == 0 or not factor(W, w):
        return
    solve_factored(W, w, x)
    lacking = weight - qp.H[n, n]
    for a in range(w):
        lacking += qp.H[faults.order[a], n] * x[a]
    if lacking > 0.0:
        qp.H[n, n] += lacking
        qp.H_diagonal[n] = qp.H[n, n]
        qp.g[n] -= lacking * path.rate
