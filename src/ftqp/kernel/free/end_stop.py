"""The end stop of a free-swinging joint as a row: it pushes, and never pulls."""

from math import inf
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import VELOCITY
from ftqp.kernel.maths.linear_systems import plus_products
from ftqp.kernel.rows.joint_intervals import fix

TOUCHES = 1e-3
"""A joint so near to its stop may be in contact [rad or m] ..."""
LEAVES = 5e-3
"""... and one in contact loses it beyond this, so that contact does not flicker."""
BOUNCE = 0.05
"""A joint that leaves its stop faster than this is not in contact [rad/s or m/s]."""


@jit
def free_motion(chain: Any, qp: Any, i: int, x: Any) -> float:
    """x_i of the free joint by its row, given those of the others: (l_i - sum_j C_ij x_j) / C_ii."""
    row, total = qp.C[i], qp.l[i]
    for j in range(chain.n):
        if j != i:
            total -= row[j] * x[j]
    return total / row[i]


@jit
def _stop_side(state: Any, limits: Any, free: Any, i: int) -> int:
    """1 at the lower stop, -1 at the upper one, 0 away from both."""
    near = LEAVES if free.contact[i] else TOUCHES
    if state.q[i] - limits.q_min[i] <= near:
        return 1
    if limits.q_max[i] - state.q[i] <= near:
        return -1
    return 0


@jit
def end_stops(K: Any, x: Any) -> None:
    """Rows and columns of the free joints in contact; ``x``: what the others are expected to do.

    Contact is near the stop, not leaving it, and pressed against it by what the others do:
    s v_i <= 0.05 and s a_i(lambda = 0) < 0, s = 1 at the lower stop and -1 at the upper one. Then a_i = 0,
    and the equality becomes s (h_i + M_ih a_h) >= 0, what the stop carries. The impact has been the stop's,
    too, and comes first: what is not pressed once it has taken the joint's velocity is not in contact.
    Source: docs/theory/free-swinging.md, "The end stop".
    """
    faults, state, free, qp = K.faults, K.state, K.free, K.qp
    for k in range(faults.working, faults.movable):
        i = faults.order[k]
        if faults.coulomb[i] > 0.0:
            _rub(state, faults, K.chain, qp, i, x)
        s = _stop_side(state, K.limits, free, i)
        if s != 0:
            x_i = free_motion(K.chain, qp, i, x) if qp.lb[i] < qp.ub[i] else qp.lb[i]
            leaving = x_i if state.level == VELOCITY else x_i + state.v[i] / state.dt
            if s * state.v[i] > BOUNCE or s * leaving >= 0.0:
                s = 0
            elif state.v[i] != 0.0:
                _absorb(K, i)
                if s * free_motion(K.chain, qp, i, x) >= 0.0:
                    s = 0
        free.contact[i], free.tau_stop[i] = s, 0.0
        if s == 0:
            continue
        carried = _without_stop(state, K.kinematics, K.chain, i)
        fix(qp, i, 0.0)
        qp.l[i], qp.u[i] = (carried, inf) if s > 0 else (-inf, carried)


@jit
def rest_on_stops(state: Any, faults: Any, free: Any) -> None:
    """A free-swinging joint that lies on a stop has no velocity: an observer that knows no stop may err."""
    for k in range(faults.working, faults.movable):
        i = faults.order[k]
        if free.contact[i]:
            state.v[i] = 0.0


@jit
def _absorb(K: Any, i: int) -> None:
    """The stop takes the joint's velocity: it counts as 0 in every row, so that no motor carries the impact.

    The observer gets it, too, unless it looks at a time before the impact: it knows no stop, and would take
    the impact for a disturbance that goes on.
    """
    state, faults, feedback, qp, M = K.state, K.faults, K.feedback, K.qp, K.kinematics.M
    v = state.v[i]
    state.v[i] = 0.0
    if feedback.latency == 0:
        feedback.v_hat[i] = feedback.d_hat[i] = 0.0
    if state.level != VELOCITY:
        shift = -faults.friction[i] * v
        qp.l[i], qp.u[i] = qp.l[i] - shift, qp.u[i] - shift
        return
    own = state.dt * K.chain.viscous[i] * v
    qp.l[i], qp.u[i] = qp.l[i] - own, qp.u[i] - own
    for j in range(K.chain.n):
        qp.l[j], qp.u[j] = qp.l[j] - M[j, i] * v, qp.u[j] - M[j, i] * v


@jit
def _rub(state: Any, faults: Any, chain: Any, qp: Any, i: int, x: Any) -> None:
    """Coulomb friction in the row: -mu sgn v' where the joint slides, anything up to mu where it is stuck."""
    x_i = free_motion(chain, qp, i, x)
    after = x_i if state.level == VELOCITY else state.v[i] + state.dt * x_i
    most = faults.coulomb[i] * (state.dt if state.level == VELOCITY else 1.0)
    slowed = faults.coulomb[i] * state.dt / qp.C[i, i]
    if after > slowed:
        qp.l[i] = qp.u[i] = qp.l[i] - most
    elif after < -slowed:
        qp.l[i] = qp.u[i] = qp.l[i] + most
    else:
        qp.l[i], qp.u[i] = qp.l[i] - most, qp.u[i] + most
        fix(qp, i, 0.0 if state.level == VELOCITY else -state.v[i] / state.dt)


@jit
def _without_stop(state: Any, kinematics: Any, chain: Any, i: int) -> float:
    """The row's value M_ih x_h at which the stop carries nothing, x_i = 0."""
    if state.level != VELOCITY:
        return -kinematics.h[i]
    total = plus_products(-state.dt * kinematics.h[i], kinematics.M[i], state.v, chain.n)
    return total


@jit
def stop_torques(state: Any, faults: Any, kinematics: Any, chain: Any, free: Any) -> None:
    """What the stops carry, M_i x + h_i of the command."""
    for k in range(faults.working, faults.movable):
        i = faults.order[k]
        if free.contact[i]:
            free.tau_stop[i] = plus_products(kinematics.h[i], kinematics.M[i], state.a_command, chain.n)
