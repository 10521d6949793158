"""A settling tick: whether the error bends more than the rows can hold, and the QP that then takes over."""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit, part_jit, rare_jit
from ftqp.kernel.latches.settling import NO_METRIC, REGULAR, settle
from ftqp.kernel.layout.enums import ACCELERATION, SCALE, TARGET_HAS_ROTATION, TARGET_TWIST
from ftqp.kernel.layout.thresholds import LAST
from ftqp.kernel.maths.linear_systems import assign, factor, minus_products, plus_products, solve_factored
from ftqp.kernel.rows.path_rows import LEAST_SETTLING
from ftqp.kernel.rows.task_rows import softness
from ftqp.kernel.rows.task_terms import share
from ftqp.kernel.settling.curvature import curvature, spread, weigh_rows
from ftqp.kernel.settling.metric import find_metric
from ftqp.kernel.settling.rest import (
    braked,
    decide,
    feedback_rate,
    gives_up,
    watch_swing,
    watch_target,
    way_to_go,
)
from ftqp.kernel.settling.trigger import is_regular


@part_jit
def settles(K: Any, kp: float) -> bool:
    """Whether the curvature of the error takes part in this tick, after ``objective``, ``task_rows``."""
    settling = K.settling
    if not settling.on or kp == 0.0:  # without feedback the error asks for nothing
        return False
    watch_target(K.state, K.faults, K.task, settling)
    watch_swing(K)
    if not settling.holding and not gives_up(settling) and is_regular(K):
        settle(settling, REGULAR, K.state.dt)
        return False
    return _takes_part(K, kp)


@rare_jit
def _takes_part(K: Any, kp: float) -> bool:
    """The same where the curvature may matter: the metric, the way to go and the pace of the feedback."""
    settling = K.settling
    square = weigh_rows(K.task, K.kinematics, K.chain, K.qp, settling)
    s = curvature(K.faults, K.task, K.kinematics, K.chain, settling)
    settling.soft = softness(K.task, K.terms, K.chain, K.qp, K.task.slack_ratio)
    if not s > settling.soft:  # no direction is stiffer than the feedback then
        settle(settling, REGULAR, K.state.dt)
        return False
    count = find_metric(K, s, square)
    if count < 0:
        settle(settling, NO_METRIC, K.state.dt)
        return False
    settling.count = count
    settling.rho = way_to_go(K.task, settling, count, settling.soft)
    decide(K, square)
    settling.beta = (
        0.0
        if settling.holding
        else braked(K.limits, settling, count, feedback_rate(K.state, K.task, kp), square)
    )
    return True


@jit
def _lean(state: Any, faults: Any, limits: Any, qp: Any, settling: Any, kp: float, kv: float) -> None:
    """A joint that the gradient presses against its range goes to its limit at the pace of the feedback.

    The full demand, which the range forbids, would bring it there at its acceleration limit. With
    w = beta kp d - kv v over those joints, d the way to the limit, psi blends in

        H_FB <- 0,  g_F <- g_F + H_FB w,  g_B <- - H_BB w,

    so that x_B = w, and the free joints know of it.
    """
    psi = settling.psi
    for a in range(settling.count, faults.working):
        i = settling.free[a]
        way = (limits.q_max[i] if settling.gradient[i] > 0.0 else limits.q_min[i]) - state.q[i]
        settling.delta[a] = settling.beta * kp * way - kv * state.v[i]
    for a in range(faults.working):
        i = settling.free[a]
        g = 0.0
        for b in range(settling.count, faults.working):
            j = settling.free[b]
            g += qp.H[i, j] * settling.delta[b]
            if a < settling.count:
                qp.H[i, j] *= 1.0 - psi
                qp.H[j, i] = qp.H[i, j]
        qp.g[i] += psi * g if a < settling.count else -psi * (g + qp.g[i])


@rare_jit
def begin_settling(K: Any, kp: float) -> None:
    """The QP of settling, without rows of the task: they are in its objective.

        acceleration   min soft f(x) + 1/2 |A x - b|^2 + 1/2 (x + kv v)' D (x + kv v)
        velocity       min soft f(x) + 1/2 |A x - b|^2 + 1/2 x' D x

    f is the scheme's objective, soft the compliance of the rows, b their right side with beta (e + kick) in
    place of the error.
    """
    task, qp = K.task, K.qp
    for k in range(task.m):
        task.asked[k] = qp.b[k] - (qp.A[k, K.chain.n] if task.mode == SCALE else 0.0)
    qp.nx = K.chain.n
    pose_settling(K, kp)


@jit
def pose_settling(K: Any, kp: float) -> None:
    """The same over the joints, from what ``task.asked`` says of the rows."""
    chain, state, task, settling, qp = K.chain, K.state, K.task, K.settling, K.qp
    n, m = chain.n, task.m
    qp.soft_last = LAST
    if K.terms.shared:
        share(K, 1.0 / settling.soft)
    kv = task.kv if state.level == ACCELERATION else 0.0
    for k in range(m):
        w = 1.0 / sqrt(task.yielding[task.rows[k]])
        settling.b[k] = w * task.asked[k] - (1.0 - settling.beta) * kp * settling.e[k]
    if qp.dense == 0:
        for i in range(n):
            qp.H[i, :n] = 0.0
            qp.H[i, i] = qp.H_diagonal[i]
    for i in range(n):
        g = minus_products(settling.soft * qp.g[i], settling.A[:, i], settling.b, m)
        for j in range(n):
            g += kv * settling.D[i, j] * state.v[j]
        qp.g[i] = g - settling.beta * kp * settling.kick[i]
        for j in range(i + 1):
            s = settling.soft * qp.H[i, j] + settling.D[i, j]
            qp.H[i, j] = qp.H[j, i] = plus_products(s, settling.A[:, i], settling.A[:, j], m)
    _lean(state, K.faults, K.limits, qp, settling, kp, kv)
    qp.dense = 1
    qp.meq = 0
    if settling.entered == 0:
        qp.warm = 0
    settling.entered = 1


APPROACHES = 6.0
"""At the velocity level joints and rate go to what they wait for with so many times the gain of the error. 4
is critically damped and slow, and with 8 a path near a singularity jolted
(tests/robustness/test_found_by_campaigns.py)."""
SLOW = 0.5
"""Rate of a path below which its ticks may be posed in settling. Faster paths are posed as if there were no
settling (docs/theory/settling.md, "Paths that wait")."""


@jit
def waits(K: Any, path: Any) -> bool:
    """Whether the path is slow, blocked, gone past or at its end; the others never pay for settling."""
    return bool(path.rate < SLOW or path.limit == 0.0 or path.aside > 0.0 or path.progress >= path.end)


@jit
def stand_still(task: Any, settling: Any, path: Any) -> bool:
    """The target of a blocked path stands where it is, without twist and acceleration; whether it does."""
    if path.limit > 0.0 or not settling.on:
        return False
    task.target[TARGET_TWIST:TARGET_HAS_ROTATION] = 0.0
    return True


@jit
def end_settling(qp: Any, settling: Any) -> None:
    """The codes of a working set depend on how many rows there are: after a settling tick it is of no use."""
    if settling.entered:
        settling.entered, qp.warm = 0, 0


@jit
def set_in_at_zero(faults: Any, task: Any, chain: Any, settling: Any) -> None:
    """D <- D psi_t/psi, and the kick: a metric that begins with a step where it begins is 0 there.

        psi_t = max(0, 1 - sigma_min^2/t),  t = (tr S^4)^(1/4)

    A path would take turns at that step: it waits for what D holds back, and leaves D as it waits. It needs
    ``find_metric``.
    """
    least = settling.squares[0] if settling.count > 0 else 0.0
    for k in range(1, task.m):
        least = min(least, settling.squares[k])
    psi = max(0.0, 1.0 - max(least, 0.0) / spread(chain, settling))
    if not psi < settling.psi:
        return
    share, settling.psi, settling.kept = psi / settling.psi, psi, 0
    for a in range(faults.working):
        i = faults.order[a]
        settling.kick[i] *= share
        for b in range(faults.working):
            settling.D[i, faults.order[b]] *= share


@rare_jit
def begin_settling_on_path(K: Any, path: Any, kp: float) -> None:
    """The QP of settling with the path rate as the last variable: A x - x' s - b in place of A x - b.

    Where the null space is drawn to a velocity, D acts on what differs from it. It needs ``rate_variable``,
    with the compliance of settling.
    Source: docs/theory/settling.md, "Paths that wait".
    """
    state, task, settling, qp = K.state, K.task, K.settling, K.qp
    n = K.chain.n
    weight = settling.soft * qp.H[n, n]
    s, g = weight, settling.soft * qp.g[n]
    assign(task.asked, qp.b, task.m)
    if state.level != ACCELERATION:
        set_in_at_zero(K.faults, task, K.chain, settling)
    pose_settling(K, kp)
    for k in range(task.m):
        settling.rate[k] = qp.A[k, n] / sqrt(task.yielding[task.rows[k]])
        s += settling.rate[k] * settling.rate[k]
        g -= settling.rate[k] * settling.b[k]
    for i in range(n):
        qp.H[i, n] = qp.H[n, i] = plus_products(0.0, settling.A[:, i], settling.rate, task.m)
    for a in range(settling.count, K.faults.working):  # pressed against their range, as in ``pose_settling``
        i = settling.free[a]
        g += settling.psi * qp.H[n, i] * settling.delta[a]
        qp.H[i, n] = qp.H[n, i] = (1.0 - settling.psi) * qp.H[n, i]
    qp.H[n, n] = qp.H_diagonal[n] = s
    qp.g[n] = g
    if path.driven:
        kv = task.kv if state.level == ACCELERATION else 1.0
        for i in range(n):
            for j in range(n):
                qp.g[i] -= kv * settling.D[i, j] * path.drive[j]
    _hold_rate(K.faults, K.chain, qp, settling, path, weight)
    if state.level != ACCELERATION and settling.count == K.faults.working:
        _approach(state, task, K.chain, qp, settling, path, kp)


@jit
def _approach(state: Any, task: Any, chain: Any, qp: Any, settling: Any, path: Any, kp: float) -> None:
    """Velocity level: in a tick joints and rate go a share of the way to the optimum, which does not swing.

        g <- c g - (1 - c) (H (v, s') + (A, -x')'(x'' s'^2 - Jdot v) dt)
        c = APPROACHES kp dt/(1 + APPROACHES kp dt)

    Not where a joint is pressed against its range: there the path has to stop at once, or the tip leaves it.
    s' is the last rate. The last term is what the rows of the motion (v, s') change by in a tick.
    Source: docs/theory/settling.md, "Paths that wait".
    """
    n, near = chain.n, 1.0 / (1.0 + APPROACHES * kp * state.dt)
    own = max(path.rate, LEAST_SETTLING)
    for i in range(n + 1):
        x = plus_products(qp.H[i, n] * path.rate, qp.H[i], state.v, n)
        for k in range(task.m):
            row = settling.rate[k] if i == n else settling.A[k, i]
            x += row * own * own * path.bend[k] * state.dt / sqrt(task.yielding[task.rows[k]])
        qp.g[i] = (1.0 - near) * qp.g[i] - near * x


@jit
def _hold_rate(faults: Any, chain: Any, qp: Any, settling: Any, path: Any, weight: float) -> None:
    """Where D < 0 along what s moves, add to 1/2 (s - sigma')^2 what keeps the QP convex.

    What is left for s when the joints follow, H_ss - h'H^-1 h, becomes ``weight`` at least.
    """
    n, w, W, x = chain.n, faults.working, settling.work, settling.beside
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
