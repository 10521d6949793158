"""Which kappa keeps the rates y(kappa) = V diag(sigma/(sigma^2 + kappa)) c inside a limit.

All of them take the thin SVD of the reduced Jacobian, J_f: with the SVD of the full one ``bound`` is not
safe, and the square V is not unique. c is short for U' right, ||V|| for the largest absolute row sum of V.
Source: Bedrossian 1993, equations 15 and 16 (there for the healthy arm); docs/theory/singularities.md,
"Damping", derives the rules.
"""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import BOUND, BOUND_2, EXACT_2, ROW, TIGHT

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
def row(P: Any) -> float:
    """The root of max_i sum_k |V_ik c_k| sigma_k/(sigma_k^2 + kappa) = limit.

    Each row's sum P falls and 1/P is concave in kappa, so that Newton's method on 1/P - 1/limit climbs to the
    root from the left, for all rows at once.
    """
    kappa = 0.0
    for _ in range(ITERATIONS):
        step = 0.0
        for k in range(P.rank):
            P.w[k] = 1.0 / (P.sigma[k] * P.sigma[k] + kappa)
        for i in range(P.f):
            s = slope = 0.0
            for k in range(P.rank):
                term = abs(P.V[k, i] * P.c[k]) * P.sigma[k] * P.w[k]
                s += term
                slope += term * P.w[k]
            if s > P.limit * (1.0 + CLOSE):
                step = max(step, s * (s - P.limit) / (P.limit * slope))
        if step <= 1e-16 * kappa:
            break
        kappa += step
    return kappa


@jit
def exact_2(P: Any) -> float:
    """The root of |y(kappa)|_2 = limit, by Newton's method on 1/|y| - 1/limit from the left.

    y is then the least-squares solution among all with |y|_2 <= limit. Source: Moré and Sorensen 1983.
    """
    kappa = 0.0
    for _ in range(ITERATIONS):
        s = slope = 0.0
        for k in range(P.rank):
            w = 1.0 / (P.sigma[k] * P.sigma[k] + kappa)
            y = P.c[k] * P.sigma[k] * w
            s += y * y
            slope += y * y * w
        norm = sqrt(s)
        if norm <= P.limit * (1.0 + CLOSE):
            break
        step = s * (norm - P.limit) / (P.limit * slope)
        if step <= 1e-16 * kappa:
            break
        kappa += step
    return kappa


@jit
def exact_inf(P: Any) -> float:
    """The smallest kappa with max |y(kappa)| <= limit, which need not fall with kappa; no root is passed by.

    |y_i| of a joint outside its limit is p - q with sums p and q of terms of one sign, both falling and
    convex in kappa, and p > limit + q. When kappa grows, the joint stays outside at least for the steps

        p (p - q - limit) / ((limit + q) |p'|)     (q at its value, 1/p below its tangent), and
        2 e / (-y' + sqrt(y'^2 + 2 q'' e)),        e = |y_i| - limit (y above y + y' d - q'' d^2/2);

    the second makes the convergence quadratic. The largest such step of any joint is safe.
    Source: docs/theory/singularities.md, "Finding the smallest kappa".
    """
    kappa = 0.0
    limit = P.limit
    for _ in range(ITERATIONS):
        step = 0.0
        for k in range(P.rank):
            P.w[k] = 1.0 / (P.sigma[k] * P.sigma[k] + kappa)
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
        if step <= 1e-16 * kappa:
            break
        kappa += step
    return kappa


@jit
def outside(P: Any) -> bool:
    """Whether y breaks the limit, in the 2-norm by ``exact_2``, else in the largest rate."""
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
    if P.rule == ROW:
        return row(P)
    if P.rule == EXACT_2:
        return exact_2(P)
    return exact_inf(P)
