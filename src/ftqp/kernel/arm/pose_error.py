"""The error between the tip and its target, and rotation vectors."""

from math import atan2, cos, sin, sqrt
from typing import Any

from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.maths.elementary import select

NEAR = 0.19140625
"""Up to this square, (7/16)^2, the arc tangent is one polynomial. The bound of the polynomial's source,
FreeBSD's s_atan.c (see `arc_tangent_over`), because its coefficients hold up to there."""


@jit
def rotation_vector(
    r00: float, r01: float, r02: float, r10: float, r11: float, r12: float, r20: float, r21: float, r22: float
) -> tuple[float, float, float]:
    """The rotation vector [rad] of a rotation matrix, accurate for every angle in [0, pi].

    It is 2 atan2(|xyz|, w) xyz/|xyz| of the quaternion (w, xyz), w >= 0, whose largest component is found
    first: near 0 that is w; near pi, where atan2(sin, cos)/sin would divide zero by zero, one of x, y, z.
    Source: Shepperd 1978.
    """
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
def turn_between(A: Any, a: int, B: Any, b: int) -> tuple[float, float, float]:
    """The rotation vector of A B' [rad]; the rows of A stand ``a`` numbers apart, those of B ``b``."""
    c, d = 2 * a, 2 * b
    return rotation_vector(
        A[0] * B[0] + A[1] * B[1] + A[2] * B[2],
        A[0] * B[b] + A[1] * B[b + 1] + A[2] * B[b + 2],
        A[0] * B[d] + A[1] * B[d + 1] + A[2] * B[d + 2],
        A[a] * B[0] + A[a + 1] * B[1] + A[a + 2] * B[2],
        A[a] * B[b] + A[a + 1] * B[b + 1] + A[a + 2] * B[b + 2],
        A[a] * B[d] + A[a + 1] * B[d + 1] + A[a + 2] * B[d + 2],
        A[c] * B[0] + A[c + 1] * B[1] + A[c + 2] * B[2],
        A[c] * B[b] + A[c + 1] * B[b + 1] + A[c + 2] * B[b + 2],
        A[c] * B[d] + A[c + 1] * B[d + 1] + A[c + 2] * B[d + 2],
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
    R, P = kinematics.R_tip, task.tip_measured
    if task.has_tip_measured:
        return P[0, 0], P[0, 1], P[0, 2], P[1, 0], P[1, 1], P[1, 2], P[2, 0], P[2, 1], P[2, 2]
    return R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8]


@jit
def _tool_axes(task: Any, kinematics: Any) -> Any:
    """The tool axis of the tip and that of the target along W, three numbers each."""
    T, axis = task.target, task.axis
    R0, R1, R2, R3, R4, R5, R6, R7, R8 = _tip_rotation(task, kinematics)
    a0 = R0 * axis[2] + R1 * axis[5] + R2 * axis[8]
    a1 = R3 * axis[2] + R4 * axis[5] + R5 * axis[8]
    a2 = R6 * axis[2] + R7 * axis[5] + R8 * axis[8]
    d0 = T[0] * axis[2] + T[1] * axis[5] + T[2] * axis[8]
    d1 = T[4] * axis[2] + T[5] * axis[5] + T[6] * axis[8]
    d2 = T[8] * axis[2] + T[9] * axis[5] + T[10] * axis[8]
    return a0, a1, a2, d0, d1, d2


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
        task.error[3], task.error[4], task.error[5] = 0.0, 0.0, 0.0
        return 0.0 * kinematics.o_tip[0]
    R0, R1, R2, R3, R4, R5, R6, R7, R8 = _tip_rotation(task, kinematics)
    if task.tool_rows:
        a0, a1, a2, d0, d1, d2 = _tool_axes(task, kinematics)
        x, y, z = a1 * d2 - a2 * d1, a2 * d0 - a0 * d2, a0 * d1 - a1 * d0
        w = a0 * d0 + a1 * d1 + a2 * d2
        sides = 1.0
    else:
        r00, r11 = T[0] * R0 + T[1] * R1 + T[2] * R2, T[4] * R3 + T[5] * R4 + T[6] * R5
        r22 = T[8] * R6 + T[9] * R7 + T[10] * R8
        x = T[8] * R3 + T[9] * R4 + T[10] * R5 - (T[4] * R6 + T[5] * R7 + T[6] * R8)
        y = T[0] * R6 + T[1] * R7 + T[2] * R8 - (T[8] * R0 + T[9] * R1 + T[10] * R2)
        z = T[4] * R0 + T[5] * R1 + T[6] * R2 - (T[0] * R3 + T[1] * R4 + T[2] * R5)
        w = 1.0 + r00 + r11 + r22
        sides = 2.0
    near = w > 0.5
    inverse = 1.0 / select(near, w, 1.0)
    square = (x * x + y * y + z * z) * inverse * inverse
    f = sides * inverse * arc_tangent_over(square)
    task.error[3], task.error[4], task.error[5] = f * x, f * y, f * z
    return select(near, square, 1.0)


@part_jit
def pose_error(K: Any) -> None:
    """e = (p_d - p; rotation vector of R_d R') along W; in axis mode the shortest turn of the tool axis.

    The tip's pose is the measured one when there is one, else that of forward kinematics.
    """
    if not near_pose_error(K.task, K.kinematics) <= NEAR:
        _any_pose_error(K.task, K.kinematics)


@jit
def _any_pose_error(task: Any, kinematics: Any) -> None:
    """The rotation part for every angle."""
    T = task.target
    if not task.uses_rotation:
        return
    R0, R1, R2, R3, R4, R5, R6, R7, R8 = _tip_rotation(task, kinematics)
    if task.tool_rows:
        axis = task.axis
        a0, a1, a2, d0, d1, d2 = _tool_axes(task, kinematics)
        x, y, z = a1 * d2 - a2 * d1, a2 * d0 - a0 * d2, a0 * d1 - a1 * d0
        along = x * a0 + y * a1 + z * a2  # rounding, large beside the product of nearly opposite axes
        x, y, z = x - along * a0, y - along * a1, z - along * a2
        s = sqrt(x * x + y * y + z * z)
        c = a0 * d0 + a1 * d1 + a2 * d2
        if s > 1e-12:
            f = atan2(s, c) / s
        elif c > 0.0:
            f = 1.0
        else:  # opposite: any axis across will do; the tool's x
            f = atan2(0.0, -1.0)
            x = R0 * axis[0] + R1 * axis[3] + R2 * axis[6]
            y = R3 * axis[0] + R4 * axis[3] + R5 * axis[6]
            z = R6 * axis[0] + R7 * axis[3] + R8 * axis[6]
        task.error[3], task.error[4], task.error[5] = f * x, f * y, f * z
        return
    task.error[3], task.error[4], task.error[5] = rotation_vector(
        T[0] * R0 + T[1] * R1 + T[2] * R2,
        T[0] * R3 + T[1] * R4 + T[2] * R5,
        T[0] * R6 + T[1] * R7 + T[2] * R8,
        T[4] * R0 + T[5] * R1 + T[6] * R2,
        T[4] * R3 + T[5] * R4 + T[6] * R5,
        T[4] * R6 + T[5] * R7 + T[6] * R8,
        T[8] * R0 + T[9] * R1 + T[10] * R2,
        T[8] * R3 + T[9] * R4 + T[10] * R5,
        T[8] * R6 + T[9] * R7 + T[10] * R8,
    )
