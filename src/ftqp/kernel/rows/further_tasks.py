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
from ftqp.kernel.arm.pose_error import rows_of, turn_of
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import ACCELERATION
from ftqp.kernel.layout.scene_room import AXIS, FRAME, MASS, OWN
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.maths.side_by_side import WIDTH, load_lanes, numbers, store_lanes, sum_of
from ftqp.kernel.maths.vectors import (
    ZERO,
    Vector,
    column,
    cross,
    inner,
    length,
    minus,
    plus,
    three,
    times,
    write,
)

ALIGNED = 1e-9
"""A sine below which two directions count as one line. Some million units of rounding."""
TURNS = 0b111000
"""The bits of the rows rx, ry, rz."""
UNTURNED = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
"""The rotation by nothing, by rows. A convention."""


@jit
def _add_point(kinematics: Any, chain: Any, body: int, p: Vector, share: float, rows: Any) -> None:
    """Add the Jacobian of a point of a body, times a share, to the first three rows."""
    for j in range(body + 1):
        if moves(chain, j, body):
            _add_column(rows, 0, j, times(share, point_column(kinematics, chain, j, p)))


@jit
def _add_column(rows: Any, first: int, j: int, x: Vector) -> None:
    """Add three numbers to column j of rows, from ``first`` on."""
    rows[first, j] += x[0]
    rows[first + 1, j] += x[1]
    rows[first + 2, j] += x[2]


@jit
def _add_turn(kinematics: Any, chain: Any, body: int, share: float, rows: Any) -> None:
    """Add the Jacobian of a body's angular velocity, times a share, to the last three rows."""
    for j in range(body + 1):
        if moves(chain, j, body) and not chain.prismatic[j]:
            _add_column(rows, 3, j, times(share, three(kinematics.axis_w[j])))


@jit
def _drift(K: Any, body: int, p: Vector) -> Vector:
    """Jdot v of a point of a body at the acceleration level; nothing of the base's."""
    if K.state.level != ACCELERATION or body < 0:
        return ZERO
    return point_drift(K.kinematics, K.chain, body, p)


@jit
def _follow_frame(K: Any, t: int) -> None:
    """Rows, error and drift of a body's point and turn towards a goal, which is a place of another body."""
    terms, kinematics, chain = K.terms, K.kinematics, K.chain
    body, other, rows = terms.body[t], terms.other[t], terms.J[t]
    p, g = point_of(kinematics, body, terms.place[t]), point_of(kinematics, other, terms.goal[t])
    _add_point(kinematics, chain, body, p, 1.0, rows)
    _add_point(kinematics, chain, other, g, -1.0, rows)
    error, b = terms.error[t], terms.b[t]
    write(error, 0, minus(g, p))
    write(b, 0, minus(_drift(K, other, g), _drift(K, body, p)))
    write(error, 3, ZERO)
    write(b, 3, ZERO)
    if terms.rows[t] & TURNS == 0:
        return
    _add_turn(kinematics, chain, body, 1.0, rows)
    _add_turn(kinematics, chain, other, -1.0, rows)
    D = terms.turn[t]  # the columns of the goal's rotation
    x, y = turned(kinematics, other, D[0::3]), turned(kinematics, other, D[1::3])
    z = turned(kinematics, other, D[2::3])
    goal = (x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2])
    own = rows_of(kinematics.R[body], 3) if body >= 0 else UNTURNED
    write(error, 3, turn_of(goal, own))
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
    total, c, d = 0.0, ZERO, ZERO
    for i in range(chain.n):
        total += chain.mass[i]
    for i in range(chain.n):
        share = chain.mass[i] / total
        p = point_of(kinematics, i, chain.com[i])
        c, d = plus(c, times(share, p)), plus(d, times(share, _drift(K, i, p)))
        _add_point(kinematics, chain, i, p, share, terms.J[t])
    write(terms.error[t], 0, minus(three(terms.goal[t]), c))
    write(terms.b[t], 0, times(-1.0, d))


@jit
def _follow_axis(K: Any, t: int) -> None:
    """The same of an axis that should point along, or at, something.

    The error is the rotation that turns a onto d, its size sin, or 1 beyond a right angle. The rows are the
    part of the angular velocity across a, and, of an axis that points at a place, the turn of d that comes
    from the motion of the axis's own origin and of the place.
    """
    terms, kinematics, chain = K.terms, K.kinematics, K.chain
    body, rows = terms.body[t], terms.J[t]
    a, p = turned(kinematics, body, terms.axis[t]), point_of(kinematics, body, terms.place[t])
    goal, error, b = terms.goal[t], terms.error[t], terms.b[t]
    d = g = three(goal)
    if terms.towards[t]:
        g = point_of(kinematics, terms.other[t], goal)
        d = minus(g, p)
    far = length(d)
    write(error, 0, ZERO)
    write(b, 0, ZERO)
    if far < ALIGNED:  # it is there: every direction will do
        return
    d = (d[0] / far, d[1] / far, d[2] / far)
    e = cross(a, d)
    if inner(a, d) < 0.0:
        if length(e) < ALIGNED:  # opposite: about any axis across
            e = _across(a)
        sine = length(e)
        e = (e[0] / sine, e[1] / sine, e[2] / sine)
    write(error, 0, e)
    for j in range(body + 1):
        if not moves(chain, j, body):
            continue
        u = ZERO
        if not chain.prismatic[j]:
            z = three(kinematics.axis_w[j])
            u = minus(z, times(inner(a, z), a))
        if terms.towards[t]:
            turn = cross(d, point_column(kinematics, chain, j, p))
            u = (u[0] + turn[0] / far, u[1] + turn[1] / far, u[2] + turn[2] / far)
        rows[0, j], rows[1, j], rows[2, j] = u
    if terms.towards[t]:  # the turn of the direction to a place that the place's motion makes
        d, other = (d[0] / far, d[1] / far, d[2] / far), terms.other[t]
        for j in range(other + 1):
            if moves(chain, j, other):
                _add_column(rows, 0, j, times(-1.0, cross(d, point_column(kinematics, chain, j, g))))
    if K.state.level == ACCELERATION and body >= 0:
        w, alpha = three(kinematics.w[body]), three(kinematics.alpha[body])
        swept = times(inner(w, a), cross(w, a))
        write(b, 0, plus(minus(times(inner(alpha, a), a), alpha), swept))


@jit
def _across(a: Vector) -> Vector:
    """A direction across a."""
    return cross(a, (1.0, 0.0, 0.0)) if abs(a[0]) < 0.6 else cross(a, (0.0, 1.0, 0.0))


@jit
def _feed_back(K: Any, t: int, k: int) -> float:
    """What row k of a frame, a mass or an axis is asked for, its drift being in b."""
    terms, state = K.terms, K.state
    stops = terms.hard[t] != 0 and K.watch.latched != 0
    rate = 0.0 if stops else terms.rate[t, k]
    pull = 0.0 if stops else terms.kp[t] * terms.error[t, k]
    if state.level != ACCELERATION:
        return rate + pull
    products = 0.0
    for at in range(0, K.chain.n, WIDTH):
        products = products + load_lanes(terms.J[t, k], at) * load_lanes(state.v, at)
    moving = sum_of(products)
    ahead = 0.0 if stops else terms.rate_change[t, k]
    asked: float = terms.b[t, k] + ahead + pull + terms.kv[t] * (rate - moving)
    return asked


@jit
def _two_of_three(K: Any, t: int) -> None:
    """The rows of an axis along two directions across it, in place of three that depend on each other."""
    terms, rows, asked = K.terms, K.terms.J[t], K.terms.asked[t]
    a = turned(K.kinematics, terms.body[t], terms.axis[t])
    u = _across(a)
    u = times(1.0 / length(u), u)
    w = cross(a, u)
    for j in range(K.chain.n):
        x = column(rows, 0, j)
        rows[0, j], rows[1, j] = inner(u, x), inner(w, x)
    x = three(asked)
    asked[0], asked[1] = inner(u, x), inner(w, x)


@jit
def _fold(chain: Any, rows: Any) -> None:
    """Columns of joints that mimic others go to their leaders."""
    if chain.mimics:
        for k in range(6):
            fold_row(chain, rows[k])


@part_jit
def term_rows(K: Any, t: int) -> None:
    """Rows of one further task into ``J``, its error, and what they ask for, in metres; needs ``motion``."""
    terms, n = K.terms, K.chain.n
    kind, rows, asked = terms.kind[t], terms.J[t], terms.asked[t]
    if kind == OWN:
        assign(asked, terms.b[t], terms.m[t])
        _fold(K.chain, rows)
        return
    for k in range(3 if terms.rows[t] & TURNS == 0 else 6):
        for at in range(0, n, WIDTH):
            store_lanes(rows[k], at, 0.0 * numbers(at))
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
