"""A tick with a closed form in the place of the QP.

Everything before is that of every tick. A closed form inside the interval and the torque rows is the command;
else the command is the allowed one that is nearest, min |x - x_cf|^2 over box and torque rows, and the status
RELAXED. What follows a QP that cannot be solved is the ladder's.
"""

from typing import Any

from ftqp.kernel.closed_forms.approximate_inverse import approximate_inverse, wrist_jacobian
from ftqp.kernel.closed_forms.pseudoinverses import closed_form
from ftqp.kernel.closed_forms.reduced_problem import gather
from ftqp.kernel.entry.tick import prepare
from ftqp.kernel.jit import jit
from ftqp.kernel.judge.ladder import climb
from ftqp.kernel.layout.enums import (
    ANSWERED,
    APPROXIMATE,
    FREE,
    HEALTHY,
    MAIN_STAGE,
    OK,
    READY,
    RELAXED,
    SOLVE,
    SOLVED,
)
from ftqp.kernel.rows.torque_rows import add_torques, within_guard

INSIDE = 1e-9
"""A bound exceeded by less than this share of 1 + its size is met: rounding of a rate exactly at a limit."""


@jit
def _failed_joints(K: Any, P: Any) -> None:
    """Which joints the closed form cannot use, and their rates: prescribed, or measured of a free one."""
    P.n = K.n
    P.swings = 0
    for i in range(K.n):
        if K.fault[i] == HEALTHY:
            P.failed[i], P.rate[i] = 0, 0.0
        else:
            P.failed[i], P.rate[i] = 1, K.lb[i]
            if K.fault[i] == FREE:
                P.rate[i] = K.v[i]
                P.swings += 1


@jit
def _eliminate_free_joints(K: Any, P: Any) -> None:
    """Put the motion of every free-swinging joint, its torque row C_i x = l_i, into the rows A x = b.

    Gauss on the free joints: E holds (C_i | l_i) triangular in them, with unit pivots. C over the free joints
    is a part of M with friction, so no pivot vanishes.
    """
    n = K.n
    free = 0
    for i in range(n):
        if K.fault[i] == FREE:
            E = P.E[free]
            E[n] = K.l[i]
            for j in range(n):
                E[j] = K.C[i, j]
                if P.failed[j] and K.fault[j] != FREE:
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
def _free_rates(K: Any, P: Any) -> None:
    """The rates of the free-swinging joints that follow from those of the others."""
    for c in range(P.swings - 1, -1, -1):
        E = P.E[c]
        i = P.swinging[c]
        s = E[K.n]
        for j in range(K.n):
            if j != i:
                s -= E[j] * P.x[j]
        P.x[i] = s


@jit
def _limits(K: Any, P: Any) -> None:
    """Limits a joint, as believed now: column_i = v_max_i / limit, limit the largest of them."""
    limit = 0.0
    for i in range(K.n):
        if P.failed[i] == 0:
            limit = max(limit, K.v_max[i])
    P.limit = limit
    for i in range(K.n):
        P.column[i] = K.v_max[i] / limit if P.failed[i] == 0 else 1.0


@jit
def resolve_task(K: Any, P: Any) -> None:
    """x of the closed form for the task's rows of this tick, into P."""
    _failed_joints(K, P)
    if P.method == APPROXIMATE:
        P.m = 6
        wrist_jacobian(K, P)
        approximate_inverse(P)
        return
    if P.own_limits:
        _limits(K, P)
    P.m = K.m
    inverse = 1.0 / K.length
    if P.swings and K.nc > 0:
        for k in range(K.m):
            P.b[k] = K.b[k]
            for i in range(K.n):
                P.A[k, i] = K.A[k, i]
        _eliminate_free_joints(K, P)
        gather(P, P.A, P.b, inverse)
        closed_form(P)
        _free_rates(K, P)
    else:
        gather(P, K.A, K.b, inverse)
        closed_form(P)


@jit
def _task_slack(K: Any) -> None:
    """slack = A x - b_task."""
    for k in range(K.m):
        s = -K.b_task[k]
        row = K.A[k]
        for i in range(K.n):
            s += row[i] * K.x[i]
        K.slack[k] = s


@jit
def _is_allowed(K: Any) -> bool:
    """Whether x lies in the interval, and in the torque rows where they are needed."""
    n = K.n
    for i in range(n):
        x, lo, hi = K.x[i], K.lb[i], K.ub[i]
        if not (x >= lo - INSIDE * (1.0 + abs(lo)) and x <= hi + INSIDE * (1.0 + abs(hi))):
            return False
    if K.guard > 0.0 and not within_guard(K):
        add_torques(K)
    for j in range(K.nc):
        s = 0.0
        row = K.C[j]
        for i in range(n):
            s += row[i] * K.x[i]
        lo, hi = K.l[j], K.u[j]
        if not (s >= lo - INSIDE * (1.0 + abs(lo)) and s <= hi + INSIDE * (1.0 + abs(hi))):
            return False
    return True


@jit
def _has_moved(K: Any, P: Any) -> bool:
    """Whether the command is another than the closed form's."""
    for i in range(K.n):
        if not abs(K.x[i] - P.x[i]) <= INSIDE * (1.0 + abs(P.x[i])):
            return True
    return False


@jit
def resolve(K: Any, P: Any) -> int:
    """One tick: the status."""
    K.kappa = 0.0
    code = prepare(K)
    if code != READY:  # a stop or an input that is not finite
        return climb(K, code, SOLVED)
    resolve_task(K, P)
    K.kappa = P.kappa
    n = K.n
    K.nx, K.meq, K.dense = n, 0, 0
    for i in range(n):
        x = P.x[i]
        K.x[i] = x
        K.H_diagonal[i], K.g[i] = 1.0, -x
        K.z_box[i] = K.z[i] = 0.0
    for k in range(K.m):
        K.y[k] = 0.0
    _task_slack(K)
    code = climb(K, ANSWERED if _is_allowed(K) else SOLVE, SOLVED)
    if K.stage == MAIN_STAGE:
        if K.qp_iterations == 0:
            K.claim = -1
        elif _has_moved(K, P) and (code == OK or code == RELAXED):
            _task_slack(K)
            K.status = code = RELAXED
    return code
