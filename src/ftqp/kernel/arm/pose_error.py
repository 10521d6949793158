"""The error between the tip and its target, and rotation vectors."""

from math import atan2, cos, pi, sin, sqrt
from typing import Any

from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.maths.elementary import select
from ftqp.kernel.maths.vectors import (
    ZERO,
    Vector,
    cross,
    inner,
    length,
    minus,
    three,
    three_from,
    times,
    write,
)

NEAR = 0.19140625
"""Up to this square, (7/16)^2, the arc tangent is one polynomial. The bound of the polynomial's source,
FreeBSD's s_atan.c (see `arc_tangent_over`), because its coefficients hold up to there."""


@jit
def rotation_vector(row: Vector, second: Vector, third: Vector) -> Vector:
    """The rotation vector [rad] of a rotation matrix by rows, accurate for every angle in [0, pi].

    It is 2 atan2(|xyz|, w) xyz/|xyz| of the quaternion (w, xyz), w >= 0, whose largest component is found
    first: near 0 that is w; near pi, where atan2(sin, cos)/sin would divide zero by zero, one of x, y, z.
    Source: Shepperd 1978.
    """
    r00, r01, r02 = row
    r10, r11, r12 = second
    r20, r21, r22 = third
    trace = r00 + r11 + r22
    if trace >= r00 and trace >= r11 and trace >= r22:
        w, x, y, z = 1.0 + trace, r21 - r12, r02 - r20, r10 - r01
    elif r00 >= r11 and r00 >= r22:
        w, x, y, z = r21 - r12, 1.0 + r00 - r11 - r22, r01 + r10, r02 + r20
    elif r11 >= r22:
        w, x, y, z = r02 - r20, r01 + r10, 1.0 + r11 - r00 - r22, r12 + r21
    else:
        w, x, y, z = r10 - r01, r02 + r20, r12 + r21, 1.0 + r22 - r00 - r11
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    s = sqrt(x * x + y * y + z * z)
    f = 2.0 * atan2(s, w) / s if s > 0.0 else 0.0
    return f * x, f * y, f * z


@jit
def rows_of(A: Any, stride: int) -> tuple[Vector, Vector, Vector]:
    """The rows of a rotation that stand ``stride`` numbers apart."""
    return three(A), three_from(A, stride), three_from(A, 2 * stride)


@jit
def turn_of(A: Any, B: Any) -> Vector:
    """The rotation vector of A B' [rad], of rows."""
    a, b, c = A
    x, y, z = B
    return rotation_vector(
        (inner(a, x), inner(a, y), inner(a, z)),
        (inner(b, x), inner(b, y), inner(b, z)),
        (inner(c, x), inner(c, y), inner(c, z)),
    )


@jit
def turn_between(A: Any, a: int, B: Any, b: int) -> Vector:
    """The same; the rows of A stand ``a`` numbers apart, those of B ``b``."""
    return turn_of(rows_of(A, a), rows_of(B, b))


@jit
def tool_turn(R: Any, T: Any) -> Vector:
    """The shortest turn of the z axis of a rotation R to that of a pose T, along the axes of T [rad]."""
    tip, goal = (R[2], R[5], R[8]), (T[2], T[6], T[10])
    turn = cross(tip, goal)
    sine = length(turn)
    f = atan2(sine, inner(tip, goal)) / sine if sine > 0.0 else 1.0
    x, y, z = rows_of(T, 4)
    return times(
        f,
        (
            x[0] * turn[0] + y[0] * turn[1] + z[0] * turn[2],
            x[1] * turn[0] + y[1] * turn[1] + z[1] * turn[2],
            x[2] * turn[0] + y[2] * turn[1] + z[2] * turn[2],
        ),
    )


@jit
def exponential(x: float, y: float, z: float, R: Any) -> None:
    """R <- cos 1 + sin/angle [w]x + (1 - cos)/angle^2 w w', (9,) by rows, w a rotation vector [rad]."""
    angle = sqrt(x * x + y * y + z * z)
    c = cos(angle)
    s = sin(angle) / angle if angle > 1e-8 else 1.0
    u = 2.0 * (sin(0.5 * angle) / angle) ** 2 if angle > 1e-8 else 0.5
    R[0], R[1], R[2] = c + u * x * x, u * x * y - s * z, u * x * z + s * y
    R[3], R[4], R[5] = u * x * y + s * z, c + u * y * y, u * y * z - s * x
    R[6], R[7], R[8] = u * x * z - s * y, u * y * z + s * x, c + u * z * z


@jit
def arc_tangent_over(square: Any) -> Any:
    """arctan(x)/x from x^2 <= NEAR, a minimax polynomial.

    Source: FreeBSD's s_atan.c (Sun Microsystems, 1993) for the coefficients.
    """
    z, w = square, square * square
    even = 4.97687799461593236017e-02 + w * 1.62858201153657823623e-02
    even = 6.66107313738753120669e-02 + w * even
    even = 9.09088713343650656196e-02 + w * even
    even = 1.42857142725034663711e-01 + w * even
    even = 3.33333333333329318027e-01 + w * even
    odd = -5.83357013379057348645e-02 + w * -3.65315727442169155270e-02
    odd = -7.69187620504482999495e-02 + w * odd
    odd = -1.11111104054623557880e-01 + w * odd
    odd = -1.99999999998764832476e-01 + w * odd
    return 1.0 - (z * even + w * odd)


@jit
def _tip_rotation(task: Any, kinematics: Any) -> Any:
    """The rotation of the tip by rows, measured or of forward kinematics."""
    P = task.tip_measured
    if task.has_tip_measured:
        return three(P[0]), three(P[1]), three(P[2])
    return rows_of(kinematics.R_tip, 3)


@jit
def _turned(rows: Any, axis: Vector) -> Vector:
    """The product of a matrix by rows and a vector."""
    a, b, c = rows
    return inner(a, axis), inner(b, axis), inner(c, axis)


@jit
def _tool_axes(task: Any, kinematics: Any) -> tuple[Vector, Vector]:
    """The tool axis of the tip and that of the target along W."""
    axis = (task.axis[2], task.axis[5], task.axis[8])
    return _turned(_tip_rotation(task, kinematics), axis), _turned(rows_of(task.target, 4), axis)


@jit
def near_pose_error(task: Any, kinematics: Any) -> Any:
    """The error of a tip that is turned little from its target, and a measure of how much.

    The error is right where the measure, tan^2 of half the angle, in axis mode of the angle, is at most
    ``NEAR``.
    """
    T, P = task.target, task.tip_measured
    for r in range(3):
        task.error[r] = T[4 * r + 3] - (P[r, 3] if task.has_tip_measured else kinematics.o_tip[r])
    if not task.uses_rotation:
        write(task.error, 3, ZERO)
        return 0.0
    if task.tool_rows:
        a, d = _tool_axes(task, kinematics)
        turn, w, sides = cross(a, d), inner(a, d), 1.0
    else:
        a, b, c = _tip_rotation(task, kinematics)
        x, y, z = rows_of(T, 4)
        turn = inner(z, b) - inner(y, c), inner(x, c) - inner(z, a), inner(y, a) - inner(x, b)
        w, sides = 1.0 + inner(x, a) + inner(y, b) + inner(z, c), 2.0
    near = w > 0.5
    inverse = 1.0 / select(near, w, 1.0)
    square = inner(turn, turn) * inverse * inverse
    write(task.error, 3, times(sides * inverse * arc_tangent_over(square), turn))
    return select(near, square, 1.0)


@part_jit
def pose_error(K: Any) -> None:
    """e = (p_d - p; rotation vector of R_d R') along W; in axis mode the shortest turn of the tool axis."""
    if not near_pose_error(K.task, K.kinematics) <= NEAR:
        _any_pose_error(K.task, K.kinematics)


@jit
def _any_pose_error(task: Any, kinematics: Any) -> None:
    """The rotation part for every angle."""
    if not task.uses_rotation:
        return
    tip = _tip_rotation(task, kinematics)
    if not task.tool_rows:
        write(task.error, 3, turn_of(rows_of(task.target, 4), tip))
        return
    a, d = _tool_axes(task, kinematics)
    turn = cross(a, d)
    turn = minus(turn, times(inner(turn, a), a))  # rounding, large beside the product of opposite axes
    s, c = length(turn), inner(a, d)
    f = 1.0
    if s > 1e-12:
        f = atan2(s, c) / s
    elif c <= 0.0:  # opposite: any axis across will do; the tool's x
        f, turn = pi, _turned(tip, (task.axis[0], task.axis[3], task.axis[6]))
    write(task.error, 3, times(f, turn))
