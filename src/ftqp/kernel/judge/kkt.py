"""KKT residuals of min 1/2 x'Hx + g'x, Ax = b, l <= Cx <= u, lb <= x <= ub."""

from math import inf
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.finite import is_finite


@jit
def violation(value: float, low: float, high: float) -> float:
    """How far a value is outside [low, high], max(low - value, value - high, 0); inf when anything is NaN."""
    if value != value or low != low or high != high:
        return inf
    return max(low - value, value - high, 0.0)


@jit
def slackness(value: float, low: float, high: float, z: float) -> float:
    """min(z+, |high - value|) or min(z-, |value - low|); |z| at an infinite bound.

    The smaller of the two and not their product, so that it is 0 exactly at complementary pairs, has no unit
    trouble with infinite bounds, and cannot hide a large multiplier behind a tiny distance.
    """
    if value != value or low != low or high != high or z != z:
        return inf
    if z > 0.0:
        return min(z, abs(high - value))
    return min(-z, abs(value - low))


@jit
def support(low: float, high: float, z: float) -> float:
    """max of z s over low <= s <= high, z+ high - z- low, infinite bounds left to ``slackness``."""
    bound = high if z > 0.0 else low
    return z * bound if is_finite(bound) else 0.0


@jit
def kkt_residuals(
    H: Any,
    g: Any,
    A: Any,
    b: Any,
    C: Any,
    l: Any,
    u: Any,
    lb: Any,
    ub: Any,
    x: Any,
    y: Any,
    z: Any,
    z_box: Any,
    out: Any,
) -> None:
    """Write the four KKT residuals of (x, y, z, z_box) into out, (4,).

        out[0] = max(|Ax - b|, violation of l <= Cx <= u and of lb <= x <= ub)      primal
        out[1] = max |Hx + g + A'y + C'z + z_box|                                   stationarity
        out[2] = max of min(z+, |u - Cx|), min(z-, |Cx - l|), and of the box        complementarity
        out[3] = |x'Hx + g'x + b'y + sum(z+ u - z- l) + sum(z_box+ ub - z_box- lb)| duality gap

    Signs: L = 1/2 x'Hx + g'x + y'(Ax - b) + z'Cx + z_box'x, so z > 0 at an upper bound. NaN anywhere makes
    the residual it touches infinite; infinite bounds are no bounds. Every array is C-contiguous.

    Source: Boyd and Vandenberghe 2004, section 5.5.3; the natural residual of complementarity.
    """
    n, m, p = len(g), len(b), len(l)
    primal, dual, complementary, gap = 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        Hx = 0.0
        for j in range(n):
            Hx += H[i, j] * x[j]
        r = Hx + g[i] + z_box[i]
        for j in range(m):
            r += A[j, i] * y[j]
        for j in range(p):
            r += C[j, i] * z[j]
        dual = max(dual, abs(r) if is_finite(r) else inf)
        primal = max(primal, violation(x[i], lb[i], ub[i]))
        complementary = max(complementary, slackness(x[i], lb[i], ub[i], z_box[i]))
        gap += x[i] * (Hx + g[i]) + support(lb[i], ub[i], z_box[i])
    for j in range(m):
        r = -b[j]
        for i in range(n):
            r += A[j, i] * x[i]
        primal = max(primal, abs(r) if is_finite(r) else inf)
        gap += b[j] * y[j]
    for j in range(p):
        row = 0.0
        for i in range(n):
            row += C[j, i] * x[i]
        primal = max(primal, violation(row, l[j], u[j]))
        complementary = max(complementary, slackness(row, l[j], u[j], z[j]))
        gap += support(l[j], u[j], z[j])
    out[0] = primal
    out[1] = dual
    out[2] = complementary
    out[3] = abs(gap) if is_finite(gap) else inf
