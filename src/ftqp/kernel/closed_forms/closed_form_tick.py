"""A tick with a closed form in the place of the QP.

Everything before is that of every tick. A closed form x_cf inside the box and the torque rows is the command;
else the command is the allowed one that is nearest, min |x - x_cf|^2 over box and torque rows, and the status
is RELAXED. When that QP cannot be solved, the cascade goes on (``ftqp.kernel.judge.fallback_cascade``).
"""

from typing import Any

from ftqp.kernel.closed_forms.approximate_inverse import approximate_inverse, wrist_jacobian
from ftqp.kernel.closed_forms.damping_factor import damping_factor
from ftqp.kernel.closed_forms.gathering import gather
from ftqp.kernel.closed_forms.pseudoinverses import closed_form
from ftqp.kernel.jit import jit
from ftqp.kernel.judge.fallback_cascade import run_cascade
from ftqp.kernel.layout.enums import (
    ANSWERED,
    APPROXIMATE,
    FREE,
    MAIN_STAGE,
    OK,
    QP_READY,
    RELAXED,
    SOLVE,
    SOLVED,
)
from ftqp.kernel.maths.svd import svd
from ftqp.kernel.rows.constraint_rows import add_constraints, keeps_torque
from ftqp.kernel.rows.one_variable import draw

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
