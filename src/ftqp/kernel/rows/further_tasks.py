"""Further tasks as terms of the objective: weight/2 |J x - b|^2 for other points, axes and joints of the arm.

Acceleration level: b = kp e + kv (goal' - J v) - Jdot v.  Velocity level: b = goal' + kp e. They share what
the task of the tip leaves, as their weights say; the columns of failed joints are those of a constant, so
that what works pays for what does not.
Source: docs/theory/further-tasks.md.
"""

from math import sqrt
from typing import Any

from ftqp.kernel.arm.points import moves, point_drift, point_of, turned
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import ACCELERATION
from ftqp.kernel.layout.terms_room import AXIS, JOINT_PLACES, MASS, OWN, POINT
from ftqp.kernel.maths.trigonometry import sin_cos
from ftqp.kernel.maths.vectors import cross

ALIGNED = 1e-9
"""A sine below which two directions count as one line. Some million units of rounding."""


@jit
def _addpoint_of(kinematics: Any, chain: Any, body: int, p0: float, p1: float, p2: float, share: float,
               rows: Any, at: int) -> None:  # fmt: skip
    """Add the Jacobian of a point of a body, times a share, to three rows."""
    for j in range(body + 1):
        if not moves(chain, j, body):
            continue
        z0, z1, z2 = kinematics.axis_w[j, 0], kinematics.axis_w[j, 1], kinematics.axis_w[j, 2]
        if not chain.prismatic[j]:
            o = kinematics.o[j]
            z0, z1, z2 = cross(z0, z1, z2, p0 - o[0], p1 - o[1], p2 - o[2])
        rows[at, j] += share * z0
        rows[at + 1, j] += share * z1
        rows[at + 2, j] += share * z2


@jit
def _follow_point(K: Any, t: int) -> None:
    """Rows, error and what is asked of a point."""
    terms, kinematics = K.terms, K.kinematics
    body = terms.body[t]
    p0, p1, p2 = point_of(kinematics, body, terms.place[t])
    _addpoint_of(kinematics, K.chain, body, p0, p1, p2, 1.0, terms.rows_of, 0)
    goal, error, b = terms.goal[t], terms.error[t], terms.b[t]
    error[0], error[1], error[2] = goal[0] - p0, goal[1] - p1, goal[2] - p2
    d0 = d1 = d2 = 0.0
    if K.state.level == ACCELERATION and body >= 0:
        o = kinematics.o[body]
        d0, d1, d2 = point_drift(kinematics, K.chain, body, p0 - o[0], p1 - o[1], p2 - o[2])
    b[0], b[1], b[2] = -d0, -d1, -d2


@jit
def _follow_mass(K: Any, t: int) -> None:
    """The same of the centre of mass of all bodies."""
    terms, kinematics, chain = K.terms, K.kinematics, K.chain
    total = c0 = c1 = c2 = d0 = d1 = d2 = 0.0
    for i in range(chain.n):
        total += chain.mass[i]
    for i in range(chain.n):
        share = chain.mass[i] / total
        p0, p1, p2 = point_of(kinematics, i, chain.com[i])
        c0, c1, c2 = c0 + share * p0, c1 + share * p1, c2 + share * p2
        _addpoint_of(kinematics, chain, i, p0, p1, p2, share, terms.rows_of, 0)
        if K.state.level == ACCELERATION:
            o = kinematics.o[i]
            u0, u1, u2 = point_drift(kinematics, chain, i, p0 - o[0], p1 - o[1], p2 - o[2])
            d0, d1, d2 = d0 + share * u0, d1 + share * u1, d2 + share * u2
    goal, error, b = terms.goal[t], terms.error[t], terms.b[t]
    error[0], error[1], error[2] = goal[0] - c0, goal[1] - c1, goal[2] - c2
    b[0], b[1], b[2] = -d0, -d1, -d2


@jit
def _follow_axis(K: Any, t: int) -> None:
    """The same of an axis that should point along, or at, something.

    The error is the rotation that turns a onto d, its size sin, or 1 beyond a right angle. The rows are the
    part of the angular velocity across a, and, of an axis that points at a place, the turn of d that comes
    from the motion of the axis's own origin.
    """
    terms, kinematics, chain = K.terms, K.kinematics, K.chain
    body, rows = terms.body[t], terms.rows_of
    a0, a1, a2 = turned(kinematics, body, terms.axis[t])
    p0, p1, p2 = point_of(kinematics, body, terms.place[t])
    goal, error, b = terms.goal[t], terms.error[t], terms.b[t]
    d0, d1, d2 = goal[0], goal[1], goal[2]
    if terms.towards[t]:
        d0, d1, d2 = d0 - p0, d1 - p1, d2 - p2
    length = sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    if length < ALIGNED:  # it is there: every direction will do
        error[0] = error[1] = error[2] = b[0] = b[1] = b[2] = 0.0
        return
    d0, d1, d2 = d0 / length, d1 / length, d2 / length
    e0, e1, e2 = cross(a0, a1, a2, d0, d1, d2)
    sine = sqrt(e0 * e0 + e1 * e1 + e2 * e2)
    if a0 * d0 + a1 * d1 + a2 * d2 < 0.0:
        if sine < ALIGNED:  # opposite: about any axis across
            e0, e1, e2 = (
                cross(a0, a1, a2, 1.0, 0.0, 0.0) if abs(a0) < 0.6 else cross(a0, a1, a2, 0.0, 1.0, 0.0)
            )
            sine = sqrt(e0 * e0 + e1 * e1 + e2 * e2)
        e0, e1, e2 = e0 / sine, e1 / sine, e2 / sine
    error[0], error[1], error[2] = e0, e1, e2
    for j in range(body + 1):
        if not moves(chain, j, body):
            continue
        z0, z1, z2 = kinematics.axis_w[j, 0], kinematics.axis_w[j, 1], kinematics.axis_w[j, 2]
        u0 = u1 = u2 = 0.0
        if chain.prismatic[j]:
            m0, m1, m2 = z0, z1, z2
        else:
            o = kinematics.o[j]
            along = a0 * z0 + a1 * z1 + a2 * z2
            u0, u1, u2 = z0 - along * a0, z1 - along * a1, z2 - along * a2
            m0, m1, m2 = cross(z0, z1, z2, p0 - o[0], p1 - o[1], p2 - o[2])
        if terms.towards[t]:
            m0, m1, m2 = cross(d0, d1, d2, m0, m1, m2)
            u0, u1, u2 = u0 + m0 / length, u1 + m1 / length, u2 + m2 / length
        rows[0, j], rows[1, j], rows[2, j] = u0, u1, u2
    b[0] = b[1] = b[2] = 0.0
    if K.state.level == ACCELERATION and body >= 0:
        w, alpha = kinematics.w[body], kinematics.alpha[body]
        turn = w[0] * a0 + w[1] * a1 + w[2] * a2
        s0, s1, s2 = cross(w[0], w[1], w[2], a0, a1, a2)
        along = alpha[0] * a0 + alpha[1] * a1 + alpha[2] * a2
        b[0] = -(alpha[0] - along * a0 - s0 * turn)
        b[1] = -(alpha[1] - along * a1 - s1 * turn)
        b[2] = -(alpha[2] - along * a2 - s2 * turn)


@jit
def _feed_back(K: Any, t: int, k: int) -> float:
    """What row k of a point or an axis is asked for, its drift being in b."""
    terms, state = K.terms, K.state
    asked: float = terms.b[t, k] + terms.kp[t] * terms.error[t, k]
    if state.level != ACCELERATION:
        return asked + terms.rate[t, k]
    moving = 0.0
    for j in range(K.chain.n):
        moving += terms.rows_of[k, j] * state.v[j]
    return asked + terms.kv[t] * (terms.rate[t, k] - moving)


@jit
def _couple(qp: Any, n: int) -> None:
    """H as a whole, of an objective that was a diagonal so far."""
    for i in range(n):
        for j in range(n):
            qp.H[i, j] = 0.0
        qp.H[i, i] = qp.H_diagonal[i]
    qp.dense = 1


@jit
def _add_row(qp: Any, n: int, row: Any, b: float, weight: float) -> None:
    """weight/2 (row x - b)^2."""
    for i in range(n):
        c = weight * row[i]
        if c != 0.0:
            qp.g[i] -= c * b
            for j in range(n):
                qp.H[i, j] += c * row[j]


@jit
def _follow_joints(K: Any, t: int) -> None:
    """A task of joints keeps the objective a diagonal."""
    terms, state, qp = K.terms, K.state, K.qp
    for i in range(K.chain.n):
        e = terms.q_goal[t, i] - state.q[i]
        if K.chain.continuous[i]:  # the short way round
            sine, cosine = sin_cos(0.5 * e)
            e = 2.0 * sine if cosine >= 0.0 else -2.0 * sine
        asked = terms.kp[t] * e
        if state.level == ACCELERATION:
            asked -= terms.kv[t] * state.v[i]
        weight = terms.weight[t] * terms.share[t, i]
        qp.H_diagonal[i] += weight
        if qp.dense:
            qp.H[i, i] += weight
        qp.g[i] -= weight * asked


@part_jit
def add_terms(K: Any) -> None:
    """The terms of all further tasks, added to H and g; needs ``forward_kinematics`` and ``motion``."""
    terms, qp, n = K.terms, K.qp, K.chain.n
    for t in range(terms.count):
        kind, weight = terms.kind[t], terms.weight[t]
        if kind == JOINT_PLACES:
            _follow_joints(K, t)
            continue
        if weight != 0.0 and not qp.dense:
            _couple(qp, n)
        if kind == OWN:
            if weight != 0.0:
                for k in range(terms.m[t]):
                    _add_row(qp, n, terms.J[t, k], terms.b[t, k], weight)
            continue
        for k in range(3):
            for j in range(n):
                terms.rows_of[k, j] = 0.0
        if kind == POINT:
            _follow_point(K, t)
        elif kind == AXIS:
            _follow_axis(K, t)
        elif kind == MASS:
            _follow_mass(K, t)
        if weight != 0.0:
            for k in range(3):
                if terms.rows[t] & (1 << k):
                    _add_row(qp, n, terms.rows_of[k], _feed_back(K, t, k), weight)
