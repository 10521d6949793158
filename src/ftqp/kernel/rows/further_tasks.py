"""Further tasks: rows J x = b for other frames, axes and joints, soft ones or before the task of the tip.

Acceleration level: b = goal'' + kp e + kv (goal' - J v) - Jdot v.  Velocity level: b = goal' + kp e. Soft
ones are terms weight/2 |J x - b|^2 of the objective: they share what the task of the tip leaves, as their
weights say; the columns of failed joints are those of a constant, so that what works pays for what does not.
Those that go before the tip's task are rows of C, see ``ftqp.kernel.rows.row_blocks``; how the others come
into the objective is ``ftqp.kernel.rows.task_terms``.
Source: docs/theory/further-tasks.md.
"""

from math import sqrt
from typing import Any

from ftqp.kernel.arm.kinematics import fold_row, moves, point_column, point_drift, point_of, turned
from ftqp.kernel.arm.pose_error import rotation_vector
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import ACCELERATION
from ftqp.kernel.layout.scene_room import AXIS, FRAME, MASS, OWN
from ftqp.kernel.maths.elementary import cross
from ftqp.kernel.maths.side_by_side import WIDTH, numbers, put, several, sum_of

ALIGNED = 1e-9
"""A sine below which two directions count as one line. Some million units of rounding."""
TURNS = 0b111000
"""The bits of the rows rx, ry, rz."""


@jit
def _add_point(kinematics: Any, chain: Any, body: int, p0: float, p1: float, p2: float, share: float,
               rows: Any) -> None:  # fmt: skip
    """Add the Jacobian of a point of a body, times a share, to the first three rows."""
    for j in range(body + 1):
        if not moves(chain, j, body):
            continue
        z0, z1, z2 = point_column(kinematics, chain, j, p0, p1, p2)
        rows[0, j] += share * z0
        rows[1, j] += share * z1
        rows[2, j] += share * z2


@jit
def _add_turn(kinematics: Any, chain: Any, body: int, share: float, rows: Any) -> None:
    """Add the Jacobian of a body's angular velocity, times a share, to the last three rows."""
    for j in range(body + 1):
        if moves(chain, j, body) and not chain.prismatic[j]:
            z = kinematics.axis_w[j]
            rows[3, j] += share * z[0]
            rows[4, j] += share * z[1]
            rows[5, j] += share * z[2]


@jit
def _drift(K: Any, body: int, p0: float, p1: float, p2: float) -> tuple[float, float, float]:
    """Jdot v of a point of a body at the acceleration level; nothing of the base's."""
    if K.state.level != ACCELERATION or body < 0:
        return 0.0, 0.0, 0.0
    o = K.kinematics.o[body]
    return point_drift(K.kinematics, K.chain, body, p0 - o[0], p1 - o[1], p2 - o[2])


@jit
def _follow_frame(K: Any, t: int) -> None:
    """Rows, error and drift of a point of a body, and of the body's turn, towards a goal that may move, too.

    The goal is a place of the body ``other``, so that of two bodies the rows are the difference.
    """
    terms, kinematics, chain = K.terms, K.kinematics, K.chain
    body, other, rows = terms.body[t], terms.other[t], terms.J[t]
    p0, p1, p2 = point_of(kinematics, body, terms.place[t])
    g0, g1, g2 = point_of(kinematics, other, terms.goal[t])
    _add_point(kinematics, chain, body, p0, p1, p2, 1.0, rows)
    _add_point(kinematics, chain, other, g0, g1, g2, -1.0, rows)
    error, b = terms.error[t], terms.b[t]
    error[0], error[1], error[2] = g0 - p0, g1 - p1, g2 - p2
    c0, c1, c2 = _drift(K, body, p0, p1, p2)
    d0, d1, d2 = _drift(K, other, g0, g1, g2)
    b[0], b[1], b[2] = d0 - c0, d1 - c1, d2 - c2
    error[3] = error[4] = error[5] = b[3] = b[4] = b[5] = 0.0
    if terms.rows[t] & TURNS == 0:
        return
    _add_turn(kinematics, chain, body, 1.0, rows)
    _add_turn(kinematics, chain, other, -1.0, rows)
    D = terms.turn[t]  # the columns of the goal's rotation, and those of the body's
    x0, x1, x2 = turned(kinematics, other, D[0::3])
    y0, y1, y2 = turned(kinematics, other, D[1::3])
    z0, z1, z2 = turned(kinematics, other, D[2::3])
    R0, R3, R6 = 1.0, 0.0, 0.0
    R1, R4, R7 = 0.0, 1.0, 0.0
    R2, R5, R8 = 0.0, 0.0, 1.0
    if body >= 0:
        R = kinematics.R[body]
        R0, R1, R2, R3, R4, R5, R6, R7, R8 = R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8]
    error[3], error[4], error[5] = rotation_vector(
        x0 * R0 + y0 * R1 + z0 * R2, x0 * R3 + y0 * R4 + z0 * R5, x0 * R6 + y0 * R7 + z0 * R8,
        x1 * R0 + y1 * R1 + z1 * R2, x1 * R3 + y1 * R4 + z1 * R5, x1 * R6 + y1 * R7 + z1 * R8,
        x2 * R0 + y2 * R1 + z2 * R2, x2 * R3 + y2 * R4 + z2 * R5, x2 * R6 + y2 * R7 + z2 * R8,
    )  # fmt: skip
    if K.state.level == ACCELERATION:
        for k in range(3):
            if body >= 0:
                b[3 + k] -= kinematics.alpha[body, k]
            if other >= 0:
                b[3 + k] += kinematics.alpha[other, k]


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
        _add_point(kinematics, chain, i, p0, p1, p2, share, terms.J[t])
        u0, u1, u2 = _drift(K, i, p0, p1, p2)
        d0, d1, d2 = d0 + share * u0, d1 + share * u1, d2 + share * u2
    goal, error, b = terms.goal[t], terms.error[t], terms.b[t]
    error[0], error[1], error[2] = goal[0] - c0, goal[1] - c1, goal[2] - c2
    b[0], b[1], b[2] = -d0, -d1, -d2


@jit
def _add_turn_of_place(kinematics: Any, chain: Any, other: int, g0: float, g1: float, g2: float,
                       d0: float, d1: float, d2: float, rows: Any) -> None:  # fmt: skip
    """Take off the turn of the direction to a place, d over its length, that the place's motion makes."""
    for j in range(other + 1):
        if not moves(chain, j, other):
            continue
        z0, z1, z2 = point_column(kinematics, chain, j, g0, g1, g2)
        u0, u1, u2 = cross(d0, d1, d2, z0, z1, z2)
        rows[0, j] -= u0
        rows[1, j] -= u1
        rows[2, j] -= u2


@jit
def _follow_axis(K: Any, t: int) -> None:
    """The same of an axis that should point along, or at, something.

    The error is the rotation that turns a onto d, its size sin, or 1 beyond a right angle. The rows are the
    part of the angular velocity across a, and, of an axis that points at a place, the turn of d that comes
    from the motion of the axis's own origin and of the place.
    """
    terms, kinematics, chain = K.terms, K.kinematics, K.chain
    body, rows = terms.body[t], terms.J[t]
    a0, a1, a2 = turned(kinematics, body, terms.axis[t])
    p0, p1, p2 = point_of(kinematics, body, terms.place[t])
    goal, error, b = terms.goal[t], terms.error[t], terms.b[t]
    d0, d1, d2 = goal[0], goal[1], goal[2]
    g0 = g1 = g2 = 0.0
    if terms.towards[t]:
        g0, g1, g2 = point_of(kinematics, terms.other[t], goal)
        d0, d1, d2 = g0 - p0, g1 - p1, g2 - p2
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
        u0 = u1 = u2 = 0.0
        if not chain.prismatic[j]:
            z0, z1, z2 = kinematics.axis_w[j, 0], kinematics.axis_w[j, 1], kinematics.axis_w[j, 2]
            along = a0 * z0 + a1 * z1 + a2 * z2
            u0, u1, u2 = z0 - along * a0, z1 - along * a1, z2 - along * a2
        if terms.towards[t]:
            m0, m1, m2 = point_column(kinematics, chain, j, p0, p1, p2)
            m0, m1, m2 = cross(d0, d1, d2, m0, m1, m2)
            u0, u1, u2 = u0 + m0 / length, u1 + m1 / length, u2 + m2 / length
        rows[0, j], rows[1, j], rows[2, j] = u0, u1, u2
    if terms.towards[t]:
        _add_turn_of_place(
            kinematics, chain, terms.other[t], g0, g1, g2, d0 / length, d1 / length, d2 / length, rows
        )
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
    """What row k of a frame, a mass or an axis is asked for, its drift being in b.

    While the arm is stopped, what goes before the tip's task asks for rest alone.
    """
    terms, state = K.terms, K.state
    stops = terms.hard[t] != 0 and K.watch.latched != 0
    rate = 0.0 if stops else terms.rate[t, k]
    pull = 0.0 if stops else terms.kp[t] * terms.error[t, k]
    if state.level != ACCELERATION:
        return rate + pull
    products = 0.0
    for at in range(0, K.chain.n, WIDTH):
        products = products + several(terms.J[t, k], at) * several(state.v, at)
    moving = sum_of(products)
    ahead = 0.0 if stops else terms.rate_change[t, k]
    asked: float = terms.b[t, k] + ahead + pull + terms.kv[t] * (rate - moving)
    return asked


@jit
def _two_of_three(K: Any, t: int) -> None:
    """The rows of an axis along two directions across it, in place of three that depend on each other."""
    terms, rows, asked = K.terms, K.terms.J[t], K.terms.asked[t]
    a0, a1, a2 = turned(K.kinematics, terms.body[t], terms.axis[t])
    u0, u1, u2 = cross(a0, a1, a2, 1.0, 0.0, 0.0) if abs(a0) < 0.6 else cross(a0, a1, a2, 0.0, 1.0, 0.0)
    length = sqrt(u0 * u0 + u1 * u1 + u2 * u2)
    u0, u1, u2 = u0 / length, u1 / length, u2 / length
    w0, w1, w2 = cross(a0, a1, a2, u0, u1, u2)
    for j in range(K.chain.n):
        x0, x1, x2 = rows[0, j], rows[1, j], rows[2, j]
        rows[0, j], rows[1, j] = u0 * x0 + u1 * x1 + u2 * x2, w0 * x0 + w1 * x1 + w2 * x2
    x0, x1, x2 = asked[0], asked[1], asked[2]
    asked[0], asked[1] = u0 * x0 + u1 * x1 + u2 * x2, w0 * x0 + w1 * x1 + w2 * x2


@jit
def _fold(chain: Any, rows: Any) -> None:
    """Columns of joints that mimic others go to their leaders."""
    if chain.mimics:
        for k in range(6):
            fold_row(chain, rows[k])


@part_jit
def term_rows(K: Any, t: int) -> None:
    """Rows of one further task into ``J``, error, and what they are asked for, in metres.

    Not of a task of joints. Needs ``forward_kinematics`` and ``motion``.
    """
    terms, n = K.terms, K.chain.n
    kind, rows, asked = terms.kind[t], terms.J[t], terms.asked[t]
    if kind == OWN:
        for k in range(terms.m[t]):
            asked[k] = terms.b[t, k]
        _fold(K.chain, rows)
        return
    for k in range(3 if terms.rows[t] & TURNS == 0 else 6):
        for at in range(0, n, WIDTH):
            put(rows[k], at, 0.0 * numbers(at))
    if kind == FRAME:
        _follow_frame(K, t)
    elif kind == AXIS:
        _follow_axis(K, t)
    elif kind == MASS:
        _follow_mass(K, t)
    for k in range(6):
        if terms.rows[t] & (1 << k) or (kind == AXIS and k < 3):
            asked[k] = _feed_back(K, t, k)
            if k >= 3:
                asked[k] *= terms.length
                for j in range(n):
                    rows[k, j] *= terms.length
    _fold(K.chain, rows)
    if kind == AXIS and terms.hard[t]:
        _two_of_three(K, t)


@jit
def error_of(terms: Any, t: int) -> tuple[float, float]:
    """How far a further task is from its target over the rows that it asks for [m, rad]."""
    squares = turns = 0.0
    for k in range(6):
        if terms.rows[t] & (1 << k) or (terms.kind[t] == AXIS and k < 3):
            e = terms.error[t, k]
            if k < 3 and terms.kind[t] != AXIS:
                squares += e * e
            else:
                turns += e * e
    return sqrt(squares), sqrt(turns)
