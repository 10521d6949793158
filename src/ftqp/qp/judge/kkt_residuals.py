"""The judge of every answer: KKT residuals of a QP, and whether they are small enough to call it solved."""

from typing import Protocol

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.workspace import kkt
from ftqp.qp.problem import Residuals

ACCEPTANCE = 1e-6
"""Largest residual that counts as solved, relative to 1 + the size of what is compared (see ``scales``)."""


class Parts(Protocol):
    """Anything with the parts of a QP: ``QP`` or ``QPBuffers``."""

    @property
    def H(self) -> FloatArray: ...
    @property
    def g(self) -> FloatArray: ...
    @property
    def A(self) -> FloatArray: ...
    @property
    def b(self) -> FloatArray: ...
    @property
    def C(self) -> FloatArray: ...
    @property
    def l(self) -> FloatArray: ...
    @property
    def u(self) -> FloatArray: ...
    @property
    def lb(self) -> FloatArray: ...
    @property
    def ub(self) -> FloatArray: ...


def residuals(problem: Parts, x: FloatArray, y: FloatArray, z: FloatArray, z_box: FloatArray) -> Residuals:
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
    solution = np.concatenate([x, z_box, y, z])
    primal, dual, complementarity, gap = (
        float(value) for value in kkt(flat, solution, len(q.g), len(q.b), len(q.l))
    )
    return Residuals(primal=primal, dual=dual, complementarity=complementarity, gap=gap)


def accepted(
    problem: Parts, found: Residuals, x: FloatArray, y: FloatArray, tolerance: float = ACCEPTANCE
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


def scales(problem: Parts, x: FloatArray, y: FloatArray) -> FloatArray:
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
