"""Which kappa keeps the rates y(kappa) = V diag(sigma/(sigma^2 + kappa)) c inside a limit.

All of them take the thin SVD of the reduced Jacobian, J_f: with the SVD of the full one ``bound`` is not
safe, and the square V is not unique. c is short for U' right, ||V|| for the largest absolute row sum of V.
Source: Bedrossian 1993, equations 15 and 16 (there for the healthy arm); docs/theory/singularities.md,
"Damping", derives the rules.

The approximate pseudoinverse J-dagger: position first, orientation with the wrist that is left.

At the wrist centre the Jacobian of an arm with a spherical wrist is [[B, 0], [D, E]], and

    J-dagger = [[B+, 0], [-E+ D B+, E+]],   v_arm = B+ v_w,  v_wrist = E+ (omega - D v_arm),

B+ and E+ being truncated: singular values up to ``threshold`` are dropped (in metres for B).
Source: Holt and Desrochers 1994, equation 8. They turn both halves into frame 6; along W the blocks are
rotated from the left, which leaves singular values and J-dagger's product with the twist as they are. Its
defect is derived in docs/theory/singularities.md.
"""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import BOUND, BOUND_2, EXACT_2, ROW, TIGHT
from ftqp.kernel.maths.elementary import cross
from ftqp.kernel.maths.svd import svd

ITERATIONS = 200
"""Newton steps at most."""
CLOSE = 1e-13
"""Relative distance to the limit at which a root counts as found. Some 500 units of rounding, because sums of
products that cancel leave that much of a norm."""


@jit
def _spread(P: Any) -> float:
    """||V|| max |c|, an upper bound of sigma-weighted rates."""
    norm = largest = 0.0
    for i in range(P.f):
        s = 0.0
        for k in range(P.rank):
            s += abs(P.V[k, i])
        norm = max(norm, s)
    for k in range(P.rank):
        largest = max(largest, abs(P.c[k]))
    return norm * largest


@jit
def bound(P: Any) -> float:
    """(||V|| max |c| / (2 limit))^2, since sigma/(sigma^2 + kappa) <= 1/(2 sqrt kappa)."""
    half = 0.5 * _spread(P) / P.limit
    return half * half


@jit
def bound_2(P: Any) -> float:
    """(|right| / (2 limit))^2: the same in the 2-norm, where ||V|| = 1; it needs no SVD."""
    s = 0.0
    for k in range(P.m):
        s += P.right[k] * P.right[k]
    return 0.25 * s / (P.limit * P.limit)


@jit
def tight(P: Any) -> float:
    """max_k max(0, sigma_k/rho - sigma_k^2), rho = limit/(||V|| max |c|): equation 15 solved exactly."""
    spread = _spread(P)
    kappa = 0.0
    for k in range(P.rank):
        kappa = max(kappa, P.sigma[k] * (spread / P.limit - P.sigma[k]))
    return kappa


@jit
def _row_step(P: Any) -> float:
    """Towards the root of max_i sum_k |V_ik c_k| sigma_k/(sigma_k^2 + kappa) = limit.

    Each row's sum P falls and 1/P is concave in kappa, so that Newton's method on 1/P - 1/limit climbs to the
    root from the left, for all rows at once.
    """
    step = 0.0
    for i in range(P.f):
        s = slope = 0.0
        for k in range(P.rank):
            term = abs(P.V[k, i] * P.c[k]) * P.sigma[k] * P.w[k]
            s += term
            slope += term * P.w[k]
        if s > P.limit * (1.0 + CLOSE):
            step = max(step, s * (s - P.limit) / (P.limit * slope))
    return step


@jit
def _exact_2_step(P: Any) -> float:
    """Towards the root of |y(kappa)|_2 = limit, by Newton's method on 1/|y| - 1/limit from the left.

    y is then the least-squares solution among all with |y|_2 <= limit. Source: Moré and Sorensen 1983.
    """
    s = slope = 0.0
    for k in range(P.rank):
        y = P.c[k] * P.sigma[k] * P.w[k]
        s += y * y
        slope += y * y * P.w[k]
    norm = sqrt(s)
    return s * (norm - P.limit) / (P.limit * slope) if norm > P.limit * (1.0 + CLOSE) else 0.0


@jit
def _exact_inf_step(P: Any) -> float:
    """Towards the smallest kappa with max |y(kappa)| <= limit, which need not fall; no root is passed.

    |y_i| of a joint outside its limit is p - q with sums p and q of terms of one sign, both falling and
    convex in kappa, and p > limit + q. When kappa grows, the joint stays outside at least for the steps

        p (p - q - limit) / ((limit + q) |p'|)     (q at its value, 1/p below its tangent), and
        2 e / (-y' + sqrt(y'^2 + 2 q'' e)),        e = |y_i| - limit (y above y + y' d - q'' d^2/2);

    the second makes the convergence quadratic. The largest such step of any joint is safe.
    Source: docs/theory/singularities.md, "Finding the smallest kappa".
    """
    step, limit = 0.0, P.limit
    for i in range(P.f):
        p = p1 = q = q1 = q2 = 0.0
        for k in range(P.rank):
            term = P.V[k, i] * P.c[k] * P.sigma[k] * P.w[k]
            w = P.w[k]
            if term > 0.0:
                p += term
                p1 += term * w
            else:
                q -= term
                q1 -= term * w
                q2 -= 2.0 * term * w * w
        if q > p:  # the joint runs backwards
            p, q = q, p
            p1, q1 = q1, p1
            q2 = 0.0
            for k in range(P.rank):
                term = P.V[k, i] * P.c[k] * P.sigma[k] * P.w[k]
                if term > 0.0:
                    q2 += 2.0 * term * P.w[k] * P.w[k]
        excess = p - q - limit
        if excess > limit * CLOSE:
            falling = p1 - q1  # -y'
            step = max(step, p * excess / ((limit + q) * p1))
            root = sqrt(falling * falling + 2.0 * q2 * excess)
            if falling + root > 0.0:
                step = max(step, 2.0 * excess / (falling + root))
    return step


@jit
def _root(P: Any) -> float:
    """kappa from 0 on by the steps of the rule."""
    kappa = 0.0
    for _ in range(ITERATIONS):
        for k in range(P.rank):
            P.w[k] = 1.0 / (P.sigma[k] * P.sigma[k] + kappa)
        if P.rule == ROW:
            step = _row_step(P)
        elif P.rule == EXACT_2:
            step = _exact_2_step(P)
        else:
            step = _exact_inf_step(P)
        if step <= 1e-16 * kappa:
            break
        kappa += step
    return kappa


@jit
def outside(P: Any) -> bool:
    """Whether y breaks the limit, in the 2-norm by EXACT_2, else in the largest rate."""
    largest = total = 0.0
    for j in range(P.f):
        y = abs(P.y[j])
        largest = max(largest, y)
        total += y * y
    if P.rule == EXACT_2:
        return not total <= P.limit * P.limit
    return not largest <= P.limit


@jit
def damping_factor(P: Any) -> float:
    """kappa by the rule of the problem, whose SVD is there."""
    if P.rule == BOUND:
        return bound(P)
    if P.rule == BOUND_2:
        return bound_2(P)
    if P.rule == TIGHT:
        return tight(P)
    return _root(P)


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
