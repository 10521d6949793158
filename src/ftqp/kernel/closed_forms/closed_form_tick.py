"""A tick with a closed form in the place of the QP.

Everything before is that of every tick. A closed form x_cf inside the box and the torque rows is the command;
else the command is the allowed one that is nearest, min |x - x_cf|^2 over box and torque rows, and the status
is RELAXED. When that QP cannot be solved, the cascade goes on (``ftqp.kernel.judge.fallback_cascade``).
"""

from typing import Any

from ftqp.kernel.closed_forms.damping_factor import (
    approximate_inverse,
    damping_factor,
    outside,
    wrist_jacobian,
)
from ftqp.kernel.jit import jit
from ftqp.kernel.judge.fallback_cascade import run_cascade
from ftqp.kernel.layout.enums import (
    ANSWERED,
    APPROXIMATE,
    DAMPED,
    FREE,
    MAIN_STAGE,
    OK,
    QP_READY,
    RELAXED,
    SOLVE,
    SOLVED,
)
from ftqp.kernel.maths.linear_systems import factor, solve_factored
from ftqp.kernel.maths.svd import svd
from ftqp.kernel.rows.constraint_rows import add_constraints, keeps_torque
from ftqp.kernel.rows.joint_intervals import draw


@jit
def gather(P: Any, A: Any, b: Any, scale: float) -> None:
    """J, right and f from rows scale A and right sides scale b, the failed joints and their rates."""
    f = 0
    for i in range(P.n):
        if not P.failed[i]:
            P.joint[f] = i
            f += 1
    P.f = f
    for k in range(P.m):
        row, J = A[k], P.J[k]
        for j in range(f):
            i = P.joint[j]
            J[j] = scale * P.column[i] * row[i]
        right = b[k]
        if f < P.n:
            for i in range(P.n):
                if P.failed[i]:
                    right -= row[i] * P.rate[i]
        P.right[k] = scale * right


@jit
def scatter(P: Any) -> None:
    """x of all joints from y of the working ones and the rates of the failed ones."""
    for i in range(P.n):
        P.x[i] = P.rate[i]
    for j in range(P.f):
        i = P.joint[j]
        P.x[i] = P.column[i] * P.y[j]


CONDITIONED = 1e-8
"""Least pivot of J J', relative to its diagonal, down to which it is factored. One refinement is then enough,
because rounding, 1e-16, grows by the pivot's inverse: to 1e-8 at first, and to 1e-16 once refined."""
REFINED = 1e-3
"""Least such pivot down to which the solution needs no refinement. Rounding leaves 1e-13 of it, for the same
reason."""


@jit
def _by_cholesky(P: Any) -> bool:
    """y = J'(J J')^-1 right, refined where that helps; False when J J' is too near singular, or J is tall."""
    m, f = P.m, P.f
    if f < m:
        return False
    J, L = P.J, P.L
    for i in range(m):
        for j in range(i + 1):
            a, b = J[i], J[j]
            s = 0.0
            for k in range(f):
                s += a[k] * b[k]
            L[i, j] = s
        P.pivot[i] = L[i, i]
    if not factor(L, m):
        return False
    worst = 0.0
    for i in range(m):
        worst = max(worst, L[i, i] * L[i, i] * P.pivot[i])
    if not worst * CONDITIONED <= 1.0:
        return False
    for k in range(f):
        P.y[k] = 0.0
    for i in range(m):
        P.w[i] = P.right[i]
    for refinement in range(1 if worst * REFINED <= 1.0 else 2):
        if refinement:
            for i in range(m):
                row = J[i]
                s = P.right[i]
                for k in range(f):
                    s -= row[k] * P.y[k]
                P.w[i] = s
        solve_factored(L, m, P.w)
        for i in range(m):
            row, t = J[i], P.w[i]
            for k in range(f):
                P.y[k] += row[k] * t
    return True


@jit
def damped(P: Any, kappa: float) -> None:
    """y = V diag(sigma/(sigma^2 + kappa)) c over the singular values above the cut-off; kappa = 0: J^+ right.

    Source: Bedrossian 1993, equation 8, in the form that holds for every kappa >= 0.
    """
    for j in range(P.f):
        P.y[j] = 0.0
    for k in range(P.rank):
        row = P.V[k]
        t = P.c[k] * P.sigma[k] / (P.sigma[k] * P.sigma[k] + kappa)
        for j in range(P.f):
            P.y[j] += row[j] * t


@jit
def closed_form(P: Any) -> None:
    """x of all joints: the pseudoinverse, or damped by ``rule`` when that breaks ``limit``; kappa.

    J and right have been filled in. With weights, column = 1/sqrt(weight) turns the least |y| into the least
    x'diag(weight) x; with a limit for each joint, column = limit_i / limit. Where the last tick was damped,
    the SVD comes first: it will be needed again.
    Source: docs/theory/singularities.md.
    """
    factored = not P.kappa > 0.0 and _by_cholesky(P)
    P.kappa = 0.0
    if not factored:
        svd(P)
        damped(P, 0.0)
    if P.method == DAMPED and outside(P):
        if factored:
            svd(P)
        P.kappa = damping_factor(P)
        damped(P, P.kappa)
    scatter(P)


INSIDE = 1e-9
"""A bound exceeded by less than this share of 1 + its size is met: rounding of a rate exactly at a limit. A
pseudoinverse with pivots of 1e-8 may lose as many as half of its sixteen digits."""


@jit
def _failed_joints(state: Any, faults: Any, chain: Any, qp: Any, P: Any) -> None:
    """Which joints the closed form cannot use, and their rates: prescribed, or measured of a free one."""
    P.n = chain.n
    P.swings = 0
    for k in range(faults.working):
        i = faults.order[k]
        P.failed[i], P.rate[i] = 0, 0.0
    for k in range(faults.working, faults.movable):
        i = faults.order[k]
        P.failed[i], P.rate[i] = 1, state.v[i]
        P.swings += 1
    for k in range(faults.movable, chain.n):
        i = faults.order[k]
        P.failed[i], P.rate[i] = 1, qp.lb[i]


@jit
def _eliminate_free_joints(faults: Any, chain: Any, qp: Any, P: Any) -> None:
    """Put the motion of every free-swinging joint, its torque row C_i x = l_i, into the rows A x = b.

    Gauss on the free joints: E holds (C_i | l_i) triangular in them, with unit pivots. C over the free joints
    is a part of M with friction, so no pivot vanishes.
    """
    n = chain.n
    free = 0
    for i in range(n):
        if faults.code[i] == FREE:
            E = P.E[free]
            E[n] = qp.l[i]
            for j in range(n):
                E[j] = qp.C[i, j]
                if P.failed[j] and faults.code[j] != FREE:
                    E[n] -= E[j] * P.rate[j]
                    E[j] = 0.0
            P.swinging[free] = i
            free += 1
    for c in range(free):
        i = P.swinging[c]
        E = P.E[c]
        inverse = 1.0 / E[i]
        for j in range(n + 1):
            E[j] *= inverse
        for d in range(c + 1, free):
            t = P.E[d, i]
            for j in range(n + 1):
                P.E[d, j] -= t * E[j]
        for k in range(P.m):
            t = P.A[k, i]
            for j in range(n):
                P.A[k, j] -= t * E[j]
            P.b[k] -= t * E[n]
            P.A[k, i] = 0.0


@jit
def _free_rates(chain: Any, P: Any) -> None:
    """The rates of the free-swinging joints that follow from those of the others."""
    for c in range(P.swings - 1, -1, -1):
        E = P.E[c]
        i = P.swinging[c]
        s = E[chain.n]
        for j in range(chain.n):
            if j != i:
                s -= E[j] * P.x[j]
        P.x[i] = s


@jit
def _limits(limits: Any, chain: Any, P: Any) -> None:
    """Limits a joint, as believed now: column_i = v_max_i / limit, limit the largest of them."""
    limit = 0.0
    for i in range(chain.n):
        if P.failed[i] == 0:
            limit = max(limit, limits.v_max[i])
    P.limit = limit
    for i in range(chain.n):
        P.column[i] = limits.v_max[i] / limit if P.failed[i] == 0 else 1.0


@jit
def resolve_task(K: Any, P: Any) -> None:
    """x of the closed form for the task's rows of this tick, into P."""
    chain, task, qp = K.chain, K.task, K.qp
    _failed_joints(K.state, K.faults, chain, qp, P)
    if P.method == APPROXIMATE:
        P.m = 6
        wrist_jacobian(task, K.kinematics, chain, qp, P)
        approximate_inverse(P)
        return
    if P.own_limits:
        _limits(K.limits, chain, P)
    P.m = task.m
    inverse = 1.0 / task.length
    if P.swings and qp.nc > 0:
        for k in range(task.m):
            P.b[k] = qp.b[k]
            for i in range(chain.n):
                P.A[k, i] = qp.A[k, i]
        _eliminate_free_joints(K.faults, chain, qp, P)
        gather(P, P.A, P.b, inverse)
        closed_form(P)
        _free_rates(chain, P)
    else:
        gather(P, qp.A, qp.b, inverse)
        closed_form(P)


@jit
def _task_slack(task: Any, chain: Any, qp: Any) -> None:
    """slack = A x - asked."""
    for k in range(task.m):
        s = -task.asked[k]
        row = qp.A[k]
        for i in range(chain.n):
            s += row[i] * qp.x[i]
        task.slack[k] = s


@jit
def _is_allowed(K: Any) -> bool:
    """Whether x lies in the interval, and in the torque rows where they are needed."""
    chain, limits, qp = K.chain, K.limits, K.qp
    n = chain.n
    for i in range(n):
        x, lo, hi = qp.x[i], qp.lb[i], qp.ub[i]
        if not (x >= lo - INSIDE * (1.0 + abs(lo)) and x <= hi + INSIDE * (1.0 + abs(hi))):
            return False
    if limits.on_demand and not K.kinematics.has_dynamics and not keeps_torque(K):
        add_constraints(K)
    for j in range(qp.nc):
        s = 0.0
        row = qp.C[j]
        for i in range(n):
            s += row[i] * qp.x[i]
        lo, hi = qp.l[j], qp.u[j]
        if not (s >= lo - INSIDE * (1.0 + abs(lo)) and s <= hi + INSIDE * (1.0 + abs(hi))):
            return False
    return True


@jit
def _has_moved(chain: Any, qp: Any, P: Any) -> bool:
    """Whether the command is another than the closed form's."""
    for i in range(chain.n):
        if not abs(qp.x[i] - P.x[i]) <= INSIDE * (1.0 + abs(P.x[i])):
            return True
    return False


@jit
def resolve(K: Any, P: Any, prepared: int) -> int:
    """A prepared tick with the closed form: the status."""
    chain, task, cascade, qp = K.chain, K.task, K.cascade, K.qp
    cascade.kappa = 0.0
    code = prepared
    if code != QP_READY:  # a stop or an input that is not finite
        return run_cascade(K, code, SOLVED)
    resolve_task(K, P)
    cascade.kappa = P.kappa
    n = chain.n
    qp.nx, qp.meq, qp.dense = n, 0, 0
    for i in range(n):
        x = P.x[i]
        qp.x[i] = x
        draw(qp, i, 1.0, x)
        qp.z_box[i] = 0.0
    for j in range(qp.nc):
        qp.z[j] = 0.0
    for k in range(task.m):
        qp.y[k] = 0.0
    _task_slack(task, chain, qp)
    code = run_cascade(K, ANSWERED if _is_allowed(K) else SOLVE, SOLVED)
    if cascade.stage == MAIN_STAGE:
        if cascade.qp_iterations == 0:
            cascade.claim = -1
        elif _has_moved(chain, qp, P) and (code == OK or code == RELAXED):
            _task_slack(task, chain, qp)
            cascade.missed = 1
            cascade.status = code = RELAXED
    return code


@jit
def resolve_reduced(P: Any) -> None:
    """x of a reduced problem alone, by its method."""
    if P.method == APPROXIMATE:
        approximate_inverse(P)
    else:
        gather(P, P.A, P.b, 1.0)
        closed_form(P)


@jit
def damp_reduced(P: Any) -> None:
    """kappa of a reduced problem by its rule, whether or not the undamped rates break the limit."""
    gather(P, P.A, P.b, 1.0)
    svd(P)
    P.kappa = damping_factor(P)
