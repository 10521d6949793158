"""Points that stay on their side of a plane, and axes that stay in a cone, as rows of the QP."""

from math import atan2, inf, sqrt
from typing import Any

from ftqp.kernel.arm.kinematics import fold_row, moves, point_column, point_drift, point_of, turned
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import ACCELERATION
from ftqp.kernel.maths.elementary import cross
from ftqp.kernel.rows.joint_intervals import braking, return_velocity, viability

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
    """The largest acceleration, or velocity, towards its plane of a point at the distance d with velocity v.

    It can still be braked before the plane, as a joint before its limit; so can the angle of an axis.
    """
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
    n0, n1, n2 = normal[0], normal[1], normal[2]
    p0, p1, p2 = point_of(kinematics, body, keeps.place[t])
    v = 0.0
    for j in range(body + 1):
        if not moves(chain, j, body):
            continue
        z0, z1, z2 = point_column(kinematics, chain, j, p0, p1, p2)
        row[j] = n0 * z0 + n1 * z1 + n2 * z2
        v += row[j] * state.v[j]
    distance = n0 * p0 + n1 * p1 + n2 * p2 - keeps.offset[t]
    keeps.distance[t] = distance
    drift = 0.0
    if state.level == ACCELERATION:
        o = kinematics.o[body]
        d0, d1, d2 = point_drift(kinematics, chain, body, p0 - o[0], p1 - o[1], p2 - o[2])
        drift = n0 * d0 + n1 * d1 + n2 * d2
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
    body, d = keeps.body[t], keeps.normal[t]
    a0, a1, a2 = turned(kinematics, body, keeps.place[t])
    k0, k1, k2 = cross(a0, a1, a2, d[0], d[1], d[2])
    s, c = sqrt(k0 * k0 + k1 * k1 + k2 * k2), a0 * d[0] + a1 * d[1] + a2 * d[2]
    angle = atan2(s, c)
    distance = keeps.offset[t] - angle
    keeps.distance[t] = distance
    w0 = w1 = w2 = alpha0 = alpha1 = alpha2 = 0.0
    for j in range(body + 1):
        if moves(chain, j, body) and not chain.prismatic[j]:
            z, v = kinematics.axis_w[j], state.v[j]
            u0, u1, u2 = cross(w0, w1, w2, z[0], z[1], z[2])
            alpha0, alpha1, alpha2 = alpha0 + v * u0, alpha1 + v * u1, alpha2 + v * u2
            w0, w1, w2 = w0 + v * z[0], w1 + v * z[1], w2 + v * z[2]
    u0, u1, u2 = cross(w0, w1, w2, a0, a1, a2)
    near = NEAR * state.dt * sqrt(u0 * u0 + u1 * u1 + u2 * u2)
    if s <= SMALLEST or (s <= near and distance > 0.5 * keeps.offset[t]):
        return -inf, inf
    k0, k1, k2 = k0 / s, k1 / s, k2 / s
    rate = -(k0 * w0 + k1 * w1 + k2 * w2)
    for j in range(body + 1):
        if moves(chain, j, body) and not chain.prismatic[j]:
            z = kinematics.axis_w[j]
            row[j] = k0 * z[0] + k1 * z[1] + k2 * z[2]
    u0, u1, u2 = cross(w0, w1, w2, u0, u1, u2)
    drift = k0 * alpha0 + k1 * alpha1 + k2 * alpha2
    drift += (d[0] * u0 + d[1] * u1 + d[2] * u2 + c * rate * rate) / s
    out = back = drift
    if (
        state.level != ACCELERATION
    ):  # what the curvature of the way adds in the tick, where it is for the worse
        out, back = state.dt * min(drift, 0.0), state.dt * max(drift, 0.0)
    least = -_most_turn(state, rate, distance, keeps.brake[t]) - out
    return least, max(_most_turn(state, -rate, keeps.offset[t] + angle, keeps.brake[t]) - back, least)


@jit
def fill(K: Any, at: int) -> int:
    """l <= C x <= u, one row a plane or cone from row ``at`` of C on; the next free row."""
    n, qp, keeps = K.chain.n, K.qp, K.keeps
    for t in range(keeps.count):
        row = qp.C[at + t]
        for j in range(n + 1):
            row[j] = 0.0
        if keeps.turns[t]:
            qp.l[at + t], qp.u[at + t] = _cone(K, t, row)
        else:
            qp.l[at + t], qp.u[at + t] = _plane(K, t, row), inf
        if K.chain.mimics:
            fold_row(K.chain, row)
    return at + keeps.count
