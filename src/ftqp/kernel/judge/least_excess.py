"""Torque limits and box that exclude each other: what the torque limits have to give, and the proof.

The least excess is found by a QP of its own, whose objective is well scaled whatever the planner's scheme
is. Then the rows are widened by it, so that the task's QP has a solution, with rows as hard as ever. To weigh
torque rows against the task in one QP takes multipliers that drown in rounding where a criterion such as
|tau|^2 is nearly singular.
Source: docs/theory/joint-limits.md, "Torque limits and box".
"""

from math import inf
from typing import Any

from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.judge.coming_to_rest import draw_to_rest
from ftqp.kernel.judge.kept_limits import is_beyond_range, is_too_fast
from ftqp.kernel.judge.qp_aside import put_aside, take_up
from ftqp.kernel.layout.enums import ACCELERATION
from ftqp.kernel.layout.thresholds import PROOF_SHARE
from ftqp.kernel.maths.cholesky import factor, solve_factored
from ftqp.kernel.rows.one_variable import bound, draw, widen

SOFTNESS = 1e-10
"""Compliance of torque rows beside |x - x_rest|^2: what bias it leaves is below any torque that matters. It
is so small because the row's excess must cost more than any way to rest (docs/theory/joint-limits.md, "Torque
limits and box")."""
ROOM = 1e-8
"""What a widened row is given beyond its least excess, as a share of 1 + |C x|, against rounding. Two digits
above the solver's tolerance of 1e-10."""
RAY = 1e-9
"""Largest share of its terms that C'z may keep along a variable without a bound on that side. A million units
of rounding."""


@jit
def _open_forced_return(state: Any, limits: Any, qp: Any, i: int) -> None:
    """Draw a joint beyond its limits back in place of forcing it: its interval ends where others end."""
    v, v_max, a_max, dt = state.v[i], limits.v_max[i], limits.a_max[i], state.dt
    if state.level == ACCELERATION:
        low, high = max(-a_max, min((-v_max - v) / dt, 0.0)), min(a_max, max((v_max - v) / dt, 0.0))
    else:
        low, high = max(v - a_max * dt, min(-v_max, v)), min(v + a_max * dt, max(v_max, v))
    draw(qp, i, 1.0, min(max(-qp.g[i], qp.lb[i]), qp.ub[i]))
    widen(qp, i, low, high)


@rare_jit
def begin_least_excess(K: Any) -> None:
    """min |x - x_rest|^2/2 + sum excess_j^2/(2 SOFTNESS) within the box, the task's QP kept aside.

    A joint beyond its limits is not forced back here: it returns as its torque allows.
    """
    faults, qp = K.faults, K.qp
    n = K.chain.n
    put_aside(K.chain, qp, K.aside)
    draw_to_rest(K, K.state.dt, 0.0, 1.0)
    for k in range(faults.working):
        i = faults.order[k]
        if is_beyond_range(K, i) or is_too_fast(K, i):
            _open_forced_return(K.state, K.limits, qp, i)
    qp.nx, qp.meq, qp.warm = n, 0, 0
    qp.soft_rows = SOFTNESS


@jit
def _without_push_on_free(faults: Any, qp: Any, scratch: Any) -> None:
    """Correct the multipliers of the free-swinging joints' rows until C'z vanishes along those joints."""
    S, r = scratch.square, scratch.impulse
    working, count = faults.working, faults.movable - faults.working
    for a in range(count):
        i = faults.order[working + a]
        s = 0.0
        for j in range(qp.nc):
            s -= qp.C[j, i] * qp.z[j]
        r[a] = s
        for b in range(count):
            S[a, b] = qp.C[i, faults.order[working + b]]
    if count > 0 and factor(S, count):
        solve_factored(S, count, r)
        for a in range(count):
            qp.z[faults.order[working + a]] += r[a]


@jit
def box_excludes_rows(faults: Any, chain: Any, qp: Any, scratch: Any, aside: Any) -> bool:
    """Whether the multipliers of the least excess prove that no x in the box keeps all rows (Farkas).

    For every x that does, (C'z)'x = z'Cx <= sum z+ u - z- l. So there is none where the least (C'z)'x of the
    box, sum t+ lb - t- ub with t = C'z, is larger. The box is the task's own.
    """
    _without_push_on_free(faults, qp, scratch)
    most, size = 0.0, 0.0
    for j in range(qp.nc):
        z = qp.z[j]
        if z != 0.0:
            bound = qp.u[j] if z > 0.0 else qp.l[j]
            if bound == inf or bound == -inf:
                return False
            most += z * bound
            size += abs(z * bound)
    least = 0.0
    for i in range(chain.n):
        t, terms = 0.0, 0.0
        for j in range(qp.nc):
            if qp.z[j] != 0.0:
                term = qp.C[j, i] * qp.z[j]
                t += term
                terms += abs(term)
        bound = aside.lb[i] if t > 0.0 else aside.ub[i]
        if bound == inf or bound == -inf:
            if abs(t) > RAY * terms:
                return False
        else:
            least += t * bound
            size += terms * abs(bound)
    return bool(least - most > PROOF_SHARE * size)


@jit
def make_room(chain: Any, qp: Any, aside: Any) -> None:
    """Take the task's QP up again, its rows widened by the least excess, its box by what did not return."""
    n = chain.n
    for j in range(qp.nc):
        if qp.l[j] < qp.u[j] or j >= qp.rigid:
            s = 0.0
            for i in range(n):
                s += qp.C[j, i] * qp.x[i]
            room = ROOM * (1.0 + abs(s))
            if s > qp.u[j]:
                qp.u[j] = s + room
            elif s < qp.l[j]:
                qp.l[j] = s - room
    take_up(chain, qp, aside)
    for i in range(n):
        bound(qp, i, min(aside.lb[i], qp.x[i]), max(aside.ub[i], qp.x[i]))
    qp.soft_rows, qp.warm = 0.0, 0


@jit
def keep_free_rows(faults: Any, chain: Any, qp: Any, scratch: Any) -> None:
    """Put into x what the free-swinging joints do when all others move as x says: their rows as equations."""
    n, S, r = chain.n, scratch.square, scratch.impulse
    working, count = faults.working, faults.movable - faults.working
    if count == 0 or qp.nc == 0:
        return
    for a in range(count):
        i = faults.order[working + a]
        s = qp.l[i] if qp.l[i] > -inf else qp.u[i]  # one side is open where an end stop carries the joint
        for j in range(n):
            s -= qp.C[i, j] * qp.x[j]
        for b in range(count):
            k = faults.order[working + b]
            s += qp.C[i, k] * qp.x[k]
            S[a, b] = qp.C[i, k]
        r[a] = s
    if factor(S, count):
        solve_factored(S, count, r)
        for a in range(count):
            i = faults.order[working + a]
            qp.x[i] = r[a] if qp.lb[i] < qp.ub[i] else qp.lb[i]
