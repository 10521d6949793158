"""The approximate pseudoinverse J-dagger: position first, orientation with the wrist that is left.

At the wrist centre the Jacobian of an arm with a spherical wrist is [[B, 0], [D, E]], and

    J-dagger = [[B+, 0], [-E+ D B+, E+]],   v_arm = B+ v_w,  v_wrist = E+ (omega - D v_arm),

B+ and E+ being truncated: singular values up to ``threshold`` are dropped (in metres for B).
Source: Holt and Desrochers 1994, equation 8. They turn both halves into frame 6; along W the blocks are
rotated from the left, which leaves singular values and J-dagger's product with the twist as they are. Its
defect is derived in docs/theory/singularities.md.
"""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.svd import svd
from ftqp.kernel.maths.vectors import cross

WRIST = 3
"""Joints of a spherical wrist."""


@jit
def _block(P: Any, first_row: int, first: int, end: int) -> None:
    """J <- three rows of A over the working joints first..end-1."""
    f = 0
    for i in range(first, end):
        if not P.failed[i]:
            P.joint[f] = i
            for k in range(3):
                P.J[k, f] = P.A[first_row + k, i]
            f += 1
    P.f = f


@jit
def _truncated(P: Any) -> None:
    """x of the block's joints = its truncated inverse times right."""
    svd(P)
    for j in range(P.f):
        P.x[P.joint[j]] = 0.0
    for k in range(P.r):
        if P.sigma[k] > P.threshold:
            t = P.c[k] / P.sigma[k]
            for j in range(P.f):
                P.x[P.joint[j]] += P.V[k, j] * t


@jit
def approximate_inverse(P: Any) -> None:
    """x = J-dagger b, A being the Jacobian at the wrist centre, (6, n), linear rows first, in m.

    Failed joints keep their rates.
    """
    n, rows = P.n, P.m
    arm = n - WRIST
    P.m = 3
    for i in range(n):
        P.x[i] = P.rate[i]
    for k in range(3):
        s = P.b[k]
        for i in range(n):
            if P.failed[i]:
                s -= P.A[k, i] * P.rate[i]
        P.right[k] = s
    _block(P, 0, 0, arm)
    _truncated(P)
    for k in range(3):
        s = P.b[3 + k]
        for i in range(n):
            if i < arm or P.failed[i]:
                s -= P.A[3 + k, i] * P.x[i]
        P.right[k] = s
    _block(P, 3, arm, n)
    _truncated(P)
    P.m = rows


@jit
def wrist_jacobian(task: Any, kinematics: Any, chain: Any, qp: Any, P: Any) -> None:
    """A and b at the wrist centre from the tick's kinematics and the task's twist.

    p_w = o + wrist z of the last joint but one; the twist moves there by v_w = v - omega x (p_tip - p_w).
    """
    n = chain.n
    middle = n - 2
    p0 = kinematics.o[middle, 0] + P.wrist * kinematics.axis_w[middle, 0]
    p1 = kinematics.o[middle, 1] + P.wrist * kinematics.axis_w[middle, 1]
    p2 = kinematics.o[middle, 2] + P.wrist * kinematics.axis_w[middle, 2]
    for i in range(n):
        z0, z1, z2 = kinematics.axis_w[i, 0], kinematics.axis_w[i, 1], kinematics.axis_w[i, 2]
        if chain.prismatic[i]:
            P.A[0, i], P.A[1, i], P.A[2, i] = z0, z1, z2
            P.A[3, i], P.A[4, i], P.A[5, i] = 0.0, 0.0, 0.0
        else:
            t0, t1, t2 = cross(
                z0, z1, z2, p0 - kinematics.o[i, 0], p1 - kinematics.o[i, 1], p2 - kinematics.o[i, 2]
            )
            P.A[0, i], P.A[1, i], P.A[2, i] = t0, t1, t2
            P.A[3, i], P.A[4, i], P.A[5, i] = z0, z1, z2
    for k in range(3):
        P.b[3 + k] = qp.b[3 + k] / task.row_scale[3 + k]
    d0, d1, d2 = kinematics.o_tip[0] - p0, kinematics.o_tip[1] - p1, kinematics.o_tip[2] - p2
    t0, t1, t2 = cross(P.b[3], P.b[4], P.b[5], d0, d1, d2)
    P.b[0], P.b[1], P.b[2] = qp.b[0] - t0, qp.b[1] - t1, qp.b[2] - t2
