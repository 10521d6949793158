"""Checks of every answer: its KKT residuals, whether they are small enough, and proofs of infeasibility."""

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.workspace import kkt
from ftqp.qp.adapters.buffers import QPBuffers
from ftqp.qp.problem import QP, Certificate, Residuals

ACCEPTANCE = 1e-6
"""Largest residual that counts as solved, relative to 1 + the size of what is compared (see ``scales``)."""
PROOF_TOLERANCE = 1e-6
"""Least violation, relative to max(1, |x|, |Cx|, |b|), that proves infeasibility; below it lies rounding."""
RAY_TOLERANCE = 1e-9
"""Largest entry of A'y + C'z, relative to the certificate, along a variable without a bound on that side."""


def residuals(
    problem: QP | QPBuffers, x: FloatArray, y: FloatArray, z: FloatArray, z_box: FloatArray
) -> Residuals:
    """The KKT residuals of (x, y, z, z_box); the formula is in ``ftqp.kernel.judge.kkt``.

    Args:
        problem: The QP.
        x: The point, (n,).
        y: Multipliers of Ax = b, (m,).
        z: Multipliers of the two-sided rows, (p,), > 0 at an upper bound.
        z_box: Multipliers of the bounds of x, (n,).

    Returns:
        Primal, dual, complementarity and gap, infinite where NaN is involved.
    """
    q = problem
    parts = (q.H, q.g, q.A, q.C, q.lb, q.b, q.l, q.ub, q.b, q.u)
    flat = np.concatenate([np.ravel(part) for part in parts])
    found = kkt(flat, np.concatenate([x, z_box, y, z]), q.n, q.m, q.p)
    primal, dual, complementarity, gap = (float(value) for value in found)
    return Residuals(primal=primal, dual=dual, complementarity=complementarity, gap=gap)


def accepted(
    problem: QP | QPBuffers, found: Residuals, x: FloatArray, y: FloatArray, tolerance: float = ACCEPTANCE
) -> bool:
    """Whether residuals say that the QP is solved: each is at most tolerance times its scale (``scales``).

    Args:
        problem: The QP.
        found: The residuals of the point.
        x: The point, (n,).
        y: Multipliers of Ax = b, (m,).
        tolerance: The largest residual over its scale that counts as solved, > 0, without unit. A larger one
            accepts coarser answers.
    """
    if not np.isfinite(found.largest):
        return False
    values = np.array([found.primal, found.dual, found.complementarity, found.gap])
    return bool((values <= tolerance * scales(problem, x, y)).all())


def scales(problem: QP | QPBuffers, x: FloatArray, y: FloatArray) -> FloatArray:
    """What each residual is compared with, (4,): 1 + the size of the terms that cancel in it.

    primal          1 + max(|x|, |Cx|, |b|)
    dual            1 + max(|Hx|, |g|)
    complementarity 1 + the smaller of these two maxima
    gap             1 + |x'Hx| + |g'x| + |b'y|
    """
    Hx = problem.H @ x
    point = max(_size(x), _size(problem.C @ x), _size(problem.b))
    force = max(_size(Hx), _size(problem.g))
    energy = abs(float(x @ Hx)) + abs(float(problem.g @ x)) + abs(float(problem.b @ y))
    return 1.0 + np.array([point, force, min(point, force), energy])


def _size(values: FloatArray) -> float:
    return float(np.abs(values).max(initial=0.0))


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
        left, bounds = right - matrix[:, ~free] @ low[~free], (low[free], high[free])
        best[free] = lsq_linear(matrix[:, free], left, bounds, method="bvls", tol=1e-14).x
    return best
