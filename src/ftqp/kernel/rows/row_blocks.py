"""Rows of C: torque limits, tasks before the tip's, planes and cones, the user's own, and pairs apart."""

from math import atan2, inf
from typing import Any

from ftqp.kernel.arm.kinematics import fold_row, moves, point_column, point_drift, point_of, turned
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import ACCELERATION, FREE, HEALTHY, VELOCITY
from ftqp.kernel.layout.rows import CLEARANCES
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.maths.vectors import ZERO, cross, inner, length, plus, three, times
from ftqp.kernel.rows.further_tasks import term_rows
from ftqp.kernel.rows.joint_intervals import braking, return_velocity, viability


@jit
def _write(qp: Any, at: int, n: int, row: Any, low: float, high: float) -> None:
    """low <= row x <= high, from row ``at`` of C on."""
    assign(qp.C[at], row, n)
    qp.C[at, n] = 0.0
    qp.l[at], qp.u[at] = low, high


@jit
def fill_torques(K: Any, at: int) -> int:
    """l <= M x <= u, one row a joint from row ``at`` of C on; the next free row.

    tau_min - h <= M a <= tau_max - h, times dt at the velocity level. A free-swinging joint's row is the
    equality tau = -(friction + viscous) v, with the velocity after the step: taken before it, where h has the
    joint's own viscous friction, strong friction on a light joint would be unstable. The row of a joint that
    is held, or asks for its brake, is open: the brake carries whatever is needed. A joint that has lost
    torque has ``tau_hold``, and where the arm's weight takes more already as much again. Those of a body that
    floats are M_b a + h_b = 0, at the velocity level M_b v = 0: momentum stays what it is, and 0.
    Source: docs/theory/joint-failures.md, "Free-swinging"; Umetani and Yoshida 1989.
    """
    chain, limits, faults, state, kinematics, qp = K.chain, K.limits, K.faults, K.state, K.kinematics, K.qp
    asks = K.feedback.asks
    n = chain.n
    scale = state.dt if state.level == VELOCITY else 1.0
    for i in range(n):
        shift = -scale * kinematics.h[i]
        row = qp.C[at + i]
        for j in range(n):
            row[j] = kinematics.M[i, j]
            if state.level == VELOCITY:
                shift += kinematics.M[i, j] * state.v[j]
        row[n] = 0.0
        fault = faults.code[i]
        if i < chain.floating:
            qp.l[at + i] = qp.u[at + i] = 0.0 if state.level == VELOCITY else shift
        elif fault == FREE:
            own = chain.viscous[i]
            friction = faults.friction[i] + own
            row[i] += friction * state.dt
            qp.l[at + i] = qp.u[at + i] = shift + (
                scale * own * state.v[i] if state.level == VELOCITY else -faults.friction[i] * state.v[i]
            )
        elif fault == HEALTHY and not asks[i]:
            most = limits.tau_max[i]
            if limits.weakened:
                most = min(most, max(limits.tau_hold[i], 2.0 * abs(kinematics.h[i]) - limits.tau_hold[i]))
            qp.l[at + i], qp.u[at + i] = shift - scale * most, shift + scale * most
        else:
            qp.l[at + i], qp.u[at + i] = -inf, inf
    return at + n


@jit
def fill_held(K: Any, at: int) -> int:
    """J x = b of every task that goes before the tip's, from row ``at`` of C on; the next free row.

    One whose weight is 0 keeps its rows, which ask for nothing. Where box and rows exclude each other the
    rows give way, as torque limits do.
    Source: docs/theory/further-tasks.md, "Before the task of the tip".
    """
    terms = K.terms
    for t in range(terms.count):
        if terms.hard[t] == 0:
            continue
        term_rows(K, t)
        for k in range(6):
            if terms.rows[t] & (1 << k) == 0:
                continue
            asked, counts = terms.asked[t, k], terms.weight[t] != 0.0
            low, high = (asked, asked) if counts else (-inf, inf)
            _write(K.qp, at, K.chain.n, terms.J[t, k], low, high)
            at += 1
    return at


HARDEST = 4.0
"""A point that is beyond its plane is braked by at most so many times what it is braked by before it."""
RETURN_SPEED = 1.0
"""The speed whose share a point, or an axis, comes back with [m/s or rad/s]. A convention; how the share
follows from the distance is said in ``joint_intervals.return_velocity``."""

NEAR = 4.0
"""An axis that is nearer to the middle of its cone than it turns in so many ticks has no row: to which side
it leaves the middle is known only behind it."""
SMALLEST = 1e-9
"""An axis that is nearer to the middle of its cone, or to the opposite of it, than this has no row [rad].
Rounding."""


@jit
def _most(state: Any, v: float, d: float, brake: float) -> float:
    """The largest acceleration, or velocity, of a point at d from its plane that can still be braked."""
    if d < 0.0:
        back = return_velocity(d, RETURN_SPEED)
        if state.level == ACCELERATION:
            return max((back - v) / state.dt, -HARDEST * brake)
        return max(back, v - HARDEST * brake * state.dt)
    if state.level == ACCELERATION:
        return viability(v, d, inf, inf, brake, state.dt)[0]
    return braking(v, d, inf, inf, brake, state.dt)[0]


@jit
def _most_turn(state: Any, v: float, d: float, brake: float) -> float:
    """``_most`` of an angle, which comes through the middle of its cone with whatever speed it had across.

    It is then braked by what stops it before its boundary, v^2/(2 (d - v dt)), or by HARDEST times ``brake``
    if that is more, and not by all that is too much in one tick.
    """
    most = _most(state, v, d, brake)
    room = d - v * state.dt
    if v <= 0.0 or room <= 0.0:
        return most
    hardest = -max(HARDEST * brake, 0.5 * v * v / room)
    return max(most, hardest if state.level == ACCELERATION else v + state.dt * hardest)


@jit
def _plane(K: Any, t: int, row: Any) -> float:
    """normal' J of a point into a row, and what its product with x is to be at least.

    Source: docs/theory/joint-limits.md, "Points on their side of a plane".
    """
    chain, state, kinematics, keeps = K.chain, K.state, K.kinematics, K.keeps
    body, normal = keeps.body[t], keeps.normal[t]
    across = three(normal)
    p = point_of(kinematics, body, keeps.place[t])
    v = 0.0
    for j in range(body + 1):
        if not moves(chain, j, body):
            continue
        row[j] = inner(across, point_column(kinematics, chain, j, p))
        v += row[j] * state.v[j]
    distance = inner(across, p) - keeps.offset[t]
    keeps.distance[t] = distance
    drift = 0.0
    if state.level == ACCELERATION:
        drift = inner(across, point_drift(kinematics, chain, body, p))
    return -_most(state, -v, distance, keeps.brake[t]) - drift


@jit
def _cone(K: Any, t: int, row: Any) -> tuple[float, float]:
    """k' J_w of an axis a into a row, k = a x d/s, and between what its product with x is to be.

    d is the direction, c = a'd and s = |a x d| are those of the angle b between them, and b' = -k'w, so that
    -b'' = k'(J_w x + alpha) + (d'(w x (w x a)) + c b'^2)/s. On the way out the axis can still be braked
    before the angle ``offset``, on the way in, through the middle, before -``offset`` on the other side.
    Source: docs/theory/joint-limits.md, "Axes in a cone".
    """
    chain, state, kinematics, keeps = K.chain, K.state, K.kinematics, K.keeps
    body, d = keeps.body[t], three(keeps.normal[t])
    a = turned(kinematics, body, keeps.place[t])
    k = cross(a, d)
    s, c = length(k), inner(a, d)
    angle = atan2(s, c)
    distance = keeps.offset[t] - angle
    keeps.distance[t] = distance
    w = alpha = ZERO
    for j in range(body + 1):
        if moves(chain, j, body) and not chain.prismatic[j]:
            z, v = three(kinematics.axis_w[j]), state.v[j]
            alpha, w = plus(alpha, times(v, cross(w, z))), plus(w, times(v, z))
    u = cross(w, a)
    near = NEAR * state.dt * length(u)
    if s <= SMALLEST or (s <= near and distance > 0.5 * keeps.offset[t]):
        return -inf, inf
    k = (k[0] / s, k[1] / s, k[2] / s)
    rate = -inner(k, w)
    for j in range(body + 1):
        if moves(chain, j, body) and not chain.prismatic[j]:
            row[j] = inner(k, three(kinematics.axis_w[j]))
    drift = inner(k, alpha) + (inner(d, cross(w, u)) + c * rate * rate) / s
    out = back = drift
    if state.level != ACCELERATION:  # what the way's curvature adds in the tick, where it is for the worse
        out, back = state.dt * min(drift, 0.0), state.dt * max(drift, 0.0)
    least = -_most_turn(state, rate, distance, keeps.brake[t]) - out
    return least, max(_most_turn(state, -rate, keeps.offset[t] + angle, keeps.brake[t]) - back, least)


@jit
def fill_keeps(K: Any, at: int) -> int:
    """l <= C x <= u, one row a plane or cone from row ``at`` of C on; the next free row."""
    n, qp, keeps = K.chain.n, K.qp, K.keeps
    for t in range(keeps.count):
        row = qp.C[at + t]
        row[: n + 1] = 0.0
        if keeps.turns[t]:
            qp.l[at + t], qp.u[at + t] = _cone(K, t, row)
        else:
            qp.l[at + t], qp.u[at + t] = _plane(K, t, row), inf
        if K.chain.mimics:
            fold_row(K.chain, row)
    return at + keeps.count


@jit
def fill_own(K: Any, at: int) -> int:
    """l <= C x <= u of the user's own, from row ``at`` of C on; the next free row."""
    keeps = K.keeps
    for k in range(keeps.own):
        _write(K.qp, at + k, K.chain.n, keeps.own_C[k], keeps.own_l[k], keeps.own_u[k])
        if K.chain.mimics:
            fold_row(K.chain, K.qp.C[at + k])
    return at + keeps.own


@jit
def fill_clearances(K: Any, at: int) -> int:
    """G x >= least of pairs of ``ftqp.kernel.scene.clearance``, which give way last; the next free row."""
    qp, scene = K.qp, K.scene
    qp.yields_from = at
    if scene.pairs == 0:
        return at
    for k in range(CLEARANCES):
        if scene.slot[k] >= 0:
            _write(qp, at + k, K.chain.n, scene.G[k], scene.least[k], inf)
        else:
            qp.C[at + k, : K.chain.n + 1] = 0.0
            qp.l[at + k], qp.u[at + k] = -inf, inf
    return at + CLEARANCES
