"""Proof that a QP has no feasible point, independent of the solver that says so."""

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.qp.problem import QP, Certificate

PROOF_TOLERANCE = 1e-6
"""Least violation, relative to max(1, |x|, |Cx|, |b|), that proves infeasibility; below it lies rounding."""
RAY_TOLERANCE = 1e-9
"""Largest entry of A'y + C'z, relative to the certificate, along a variable without a bound on that side."""


def infeasibility(problem: QP) -> Certificate | None:
    """The Farkas certificate of an infeasible QP, or None when there is none.

    The point within lb <= x <= ub closest to the other constraints is found by bounded least squares,

        min |Ax - b|^2 + |Cx - s|^2   over lb <= x <= ub, l <= s <= u;

    what remains there, y = Ax - b, z = Cx - s and z_box = -(A'y + C'z), is the certificate, of value
    -(|y|^2 + |z|^2). The value is recomputed from y and z alone, so an inexact least-squares answer cannot
    prove anything false.
    """
    low, high = np.concatenate([problem.lb, problem.l]), np.concatenate([problem.ub, problem.u])
    n, m, p = problem.n, problem.m, problem.p
    if m + p == 0:
        return None
    matrix = np.zeros((m + p, n + p))
    matrix[:m, :n], matrix[m:, :n] = problem.A, problem.C
    matrix[m:, n:] = -np.eye(p)
    right = np.concatenate([problem.b, np.zeros(p)])
    nearest = _bounded_least_squares(matrix, right, low, high)
    rest = matrix @ nearest - right
    scale = max(1.0, *np.abs(nearest), *np.abs(problem.b))
    violation = float(np.abs(rest).max())
    if not violation > PROOF_TOLERANCE * scale:
        return None
    y, z = rest[:m], rest[m:]
    z_box = -(problem.A.T @ y + problem.C.T @ z)
    multipliers = np.concatenate([z_box, z])
    bounds = np.where(multipliers > 0.0, high, low)
    open_side = ~np.isfinite(bounds)
    # On a side without a bound a multiplier is rounding of the least squares, or nothing is proven.
    negligible = RAY_TOLERANCE * violation * max(1.0, float(np.abs(matrix).max()))
    if np.abs(multipliers[open_side]).max(initial=0.0) > negligible:
        return None
    value = float(problem.b @ y + multipliers[~open_side] @ bounds[~open_side])
    if not value < -0.5 * float(rest @ rest):
        return None
    return Certificate(y=y, z=z, z_box=z_box, violation=violation)


def _bounded_least_squares(
    matrix: FloatArray, right: FloatArray, low: FloatArray, high: FloatArray
) -> FloatArray:
    """min |matrix v - right|^2 over low <= v <= high, where equal bounds are allowed."""
    from scipy.optimize import lsq_linear  # a second to load, needed only when a solve did not succeed

    free = low < high
    best = np.where(free, 0.0, low)
    if free.any():
        result = lsq_linear(
            matrix[:, free],
            right - matrix[:, ~free] @ low[~free],
            (low[free], high[free]),
            method="bvls",
            tol=1e-14,
        )
        best[free] = result.x
    return best
