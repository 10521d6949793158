"""A path that waits, in calm: when its ticks are posed so, and the QP with its rate as one more variable."""

from math import sqrt
from typing import Any

from ftqp.kernel.calm.calm_qp import pose_calm
from ftqp.kernel.calm.curvature import spread
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import ACCELERATION, TARGET_HAS_ROTATION, TARGET_TWIST
from ftqp.kernel.maths.cholesky import factor, solve_factored
from ftqp.kernel.rows.path_rows import LEAST_IN_CALM

APPROACHES = 6.0
"""At the velocity level joints and rate go to what they wait for with so many times the gain of the error. 4
is critically damped and slow, and with 8 a path near a singularity jolted
(tests/robustness/test_jolts_on_slow_paths.py)."""
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
