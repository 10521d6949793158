"""One QP, one call: solve it with any backend and check the answer."""

from collections.abc import Mapping
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.qp.adapters.backend import Backend, Claim, QPBuffers
from ftqp.qp.adapters.registry import backend as backend_of
from ftqp.qp.problem import PARTS, QP, Certificate, Residuals, Solution, SolveStatus

ACCEPTANCE = 1e-6
"""Largest residual that counts as solved, relative to 1 + the size of what is compared (see ``scales``)."""
PROOF_TOLERANCE = 1e-9
"""Least |value| of a certificate, relative to the sum of the sizes of its terms, that proves infeasibility:
they cancel to all but this share. Below it may lie rounding of the data, some 1e-12."""
NEWTON_STEPS = 100
"""Steps in search of a proof at most, so that none goes on for ever."""
HALVINGS = 40
"""How often a step is halved at most: what is left then, 1e-12 of it, is rounding."""
RAY_TOLERANCE = 1e-9
"""Largest entry of A'y + C'z, relative to the certificate, along a variable without a bound on that side."""


def residuals(
    problem: QP | QPBuffers, x: FloatArray, y: FloatArray, z: FloatArray, z_box: FloatArray
) -> Residuals:
    """The KKT residuals of (x, y, z, z_box).

        primal          max(|Ax - b|, violation of l <= Cx <= u and of lb <= x <= ub)
        dual            max |Hx + g + A'y + C'z + z_box|
        complementarity max of min(z+, |u - Cx|), min(z-, |Cx - l|), and of the box
        gap             |x'Hx + g'x + b'y + sum(z+ u - z- l) + sum(z_box+ ub - z_box- lb)|

    Signs: L = 1/2 x'Hx + g'x + y'(Ax - b) + z'Cx + z_box'x, so z > 0 at an upper bound. The smaller of a
    multiplier and a distance, not their product, is 0 exactly at complementary pairs, and cannot hide a large
    multiplier behind a tiny distance; at an infinite bound it is the multiplier, which the gap leaves out.

    Args:
        problem: The QP.
        x: The point, (n,).
        y: Multipliers of Ax = b, (m,).
        z: Multipliers of the two-sided rows, (p,), > 0 at an upper bound.
        z_box: Multipliers of the bounds of x, (n,).

    Returns:
        Primal, dual, complementarity and gap, infinite where NaN is involved.

    Source: Boyd and Vandenberghe 2004, section 5.5.3; the natural residual of complementarity.
    """
    q = problem
    with np.errstate(invalid="ignore", over="ignore"):
        values, multipliers = np.concatenate([x, q.C @ x]), np.concatenate([z_box, z])
        low, high = np.concatenate([q.lb, q.l]), np.concatenate([q.ub, q.u])
        bounds = np.where(multipliers > 0.0, high, low)
        force = q.H @ x + q.g
        found = {
            "primal": np.concatenate([abs(q.A @ x - q.b), low - values, values - high]),
            "dual": abs(force + q.A.T @ y + q.C.T @ z + z_box),
            "complementarity": np.minimum(abs(multipliers), abs(bounds - values)),
            "gap": abs(x @ force + q.b @ y + np.where(np.isinf(bounds), 0.0, multipliers * bounds).sum()),
        }
        largest = {name: np.max(terms, initial=0.0) for name, terms in found.items()}
    return Residuals(**{name: inf if np.isnan(value) else float(value) for name, value in largest.items()})


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

    At the point within lb <= x <= ub closest to the other constraints (``_nearest``) what remains of them,
    y = Ax - b, z = Cx - clip(Cx, l, u) and z_box = -(A'y + C'z), is the certificate, of value
    -(|y|^2 + |z|^2). The value is recomputed from y and z alone, so no inexact point proves what is false.
    """
    q, m = problem, problem.m
    if m + q.p == 0:
        return None
    rows = np.vstack([q.A, q.C])
    below, above = np.concatenate([q.b, q.l]), np.concatenate([q.b, q.u])
    point = _nearest(rows, below, above, q.lb, q.ub)
    rest = _missed(rows @ point, below, above)
    out, free = rest != 0.0, (point > q.lb) & (point < q.ub)
    missed = rows[np.ix_(out, free)]  # what they pull free variables by is rounding: it is taken out
    rest[out] -= missed @ np.linalg.lstsq(missed, rest[out], rcond=None)[0]
    violation = _size(rest)
    z_box = -(rows.T @ rest)
    multipliers = np.concatenate([z_box, rest])
    bounds = np.where(multipliers > 0.0, np.concatenate([q.ub, above]), np.concatenate([q.lb, below]))
    open_side = ~np.isfinite(bounds)
    # On a side without a bound a multiplier is rounding of the least squares, or nothing is proven.
    negligible = RAY_TOLERANCE * violation * max(1.0, _size(rows))
    if _size(multipliers[open_side]) > negligible:
        return None
    terms = multipliers[~open_side] * bounds[~open_side]
    least = max(0.5 * float(rest @ rest), PROOF_TOLERANCE * float(np.abs(terms).sum()))
    if not float(terms.sum()) < -least:
        return None
    return Certificate(y=rest[:m], z=rest[m:], z_box=z_box, violation=violation)


def _missed(values: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    return values - np.clip(values, low, high)


def _nearest(
    rows: FloatArray, below: FloatArray, above: FloatArray, lb: FloatArray, ub: FloatArray
) -> FloatArray:
    """The x within lb <= x <= ub closest to below <= rows x <= above, by projected Newton steps.

        min 1/2 |rows x - clip(rows x, below, above)|^2

    is piecewise quadratic: a step is the least squares of the rows that are missed, over the variables that
    no bound holds. It ends where nothing is gained any more, and after ``NEWTON_STEPS`` at the latest.
    """
    x = np.clip(np.zeros(len(lb)), lb, ub)
    rest = _missed(rows @ x, below, above)
    for _ in range(NEWTON_STEPS):
        slope = rows.T @ rest
        free, out = ~(((x <= lb) & (slope >= 0.0)) | ((x >= ub) & (slope <= 0.0))), rest != 0.0
        if not (free.any() and out.any()):
            break
        step = np.zeros(len(x))
        step[free] = np.linalg.lstsq(rows[np.ix_(out, free)], -rest[out], rcond=None)[0]
        for share in 0.5 ** np.arange(HALVINGS):
            to = np.clip(x + share * step, lb, ub)
            left = _missed(rows @ to, below, above)
            if left @ left < rest @ rest:
                break
        else:
            break
        x, rest = to, left
    return np.asarray(x)


def solve(
    problem: QP, backend: str | Path | Mapping[str, Any] | Backend = "active_set", **settings: Any
) -> Solution:
    """Solve a QP, cold.

    The solver's word is not taken. The status is SOLVED exactly when the KKT residuals are small enough
    (``ftqp.qp.accepted``), INFEASIBLE exactly when they are not and a Farkas certificate is found
    (``ftqp.qp.solving.infeasibility``), whatever the solver claimed; otherwise it is MAX_ITERATIONS if
    the solver ran into its cap, else FAILED.

    Args:
        problem: The QP.
        backend: The solver: a name, a mapping with name and settings, a profile's path, or a backend object.
        **settings: Settings of the backend, when it is given by name; unknown ones are errors.

    Returns:
        The answer, checked by its residuals.

    Raises:
        InputError: This is no QP, the backend or a setting is unknown, or the QP is too large for it.
        MissingPackage: The solver's package is not installed.
    """
    if not isinstance(problem, QP):
        raise InputError(f"the problem is a {type(problem).__name__}, expected an ftqp.QP")
    if settings:
        if not isinstance(backend, str) or backend.endswith(".toml"):
            names = ", ".join(settings)
            raise InputError(
                f"{names} were given together with a backend that is not a name; put them into that backend"
            )
        backend = {**settings, "name": backend}
    solver = backend_of(backend)
    buffers = loaded(problem)
    solver.setup(buffers)
    return checked(problem, solver, buffers, solver.solve(cold=True))


def loaded(problem: QP) -> QPBuffers:
    """New buffers that hold the problem; their solution is NaN."""
    buffers = QPBuffers.zeros(problem.n, problem.m, problem.p)
    for name in PARTS:
        getattr(buffers, name)[...] = getattr(problem, name)
    buffers.solution[:] = np.nan
    return buffers


def checked(problem: QP, solver: Backend, buffers: QPBuffers, claim: Claim) -> Solution:
    """What the buffers hold after a solve that ended in ``claim``, with the status by its residuals."""
    x, y, z, z_box = (part.copy() for part in (buffers.x, buffers.y, buffers.z, buffers.z_box))
    found, certificate = residuals(problem, x, y, z, z_box), None
    if accepted(problem, found, x, y):
        status = SolveStatus.SOLVED
    elif (certificate := infeasibility(problem)) is not None:
        status = SolveStatus.INFEASIBLE
    else:
        known = claim in (Claim.MAX_ITERATIONS, Claim.OUT_OF_TIME)
        status = SolveStatus[claim.name] if known else SolveStatus.FAILED
    return Solution(
        x=x, y=y, z=z, z_box=z_box, status=status, iterations=solver.iterations, residuals=found,
        backend=solver.name, certificate=certificate,
    )  # fmt: skip
