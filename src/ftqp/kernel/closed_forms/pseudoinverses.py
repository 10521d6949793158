"""The closed forms: pseudoinverse, weighted pseudoinverse and damped inverse of the reduced Jacobian."""

from typing import Any

from ftqp.kernel.closed_forms.damping_factor import damping_factor, outside
from ftqp.kernel.closed_forms.gathering import scatter
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import DAMPED
from ftqp.kernel.maths.cholesky import factor, solve_factored
from ftqp.kernel.maths.svd import svd

CONDITIONED = 1e-8
"""Least pivot of J J', relative to its diagonal, down to which it is factored. One refinement is then enough,
because rounding, 1e-16, grows by the pivot's inverse: to 1e-8 at first, and to 1e-16 once refined."""
REFINED = 1e-3
"""Least such pivot down to which the solution needs no refinement. Rounding leaves 1e-13 of it, for the same
reason."""


@jit
def _by_cholesky(P: Any) -> bool:
    """y = J'(J J')^-1 right, refined where that helps; False when J J' is too near singular, or J is tall."""
    m, f = P.m, P.f
    if f < m:
        return False
    J, L = P.J, P.L
    for i in range(m):
        for j in range(i + 1):
            a, b = J[i], J[j]
            s = 0.0
            for k in range(f):
                s += a[k] * b[k]
            L[i, j] = s
        P.pivot[i] = L[i, i]
    if not factor(L, m):
        return False
    worst = 0.0
    for i in range(m):
        worst = max(worst, L[i, i] * L[i, i] * P.pivot[i])
    if not worst * CONDITIONED <= 1.0:
        return False
    for k in range(f):
        P.y[k] = 0.0
    for i in range(m):
        P.w[i] = P.right[i]
    for refinement in range(1 if worst * REFINED <= 1.0 else 2):
        if refinement:
            for i in range(m):
                row = J[i]
                s = P.right[i]
                for k in range(f):
                    s -= row[k] * P.y[k]
                P.w[i] = s
        solve_factored(L, m, P.w)
        for i in range(m):
            row, t = J[i], P.w[i]
            for k in range(f):
                P.y[k] += row[k] * t
    return True


@jit
def damped(P: Any, kappa: float) -> None:
    """y = V diag(sigma/(sigma^2 + kappa)) c over the singular values above the cut-off; kappa = 0: J^+ right.

    Source: Bedrossian 1993, equation 8, in the form that holds for every kappa >= 0.
    """
    for j in range(P.f):
        P.y[j] = 0.0
    for k in range(P.rank):
        row = P.V[k]
        t = P.c[k] * P.sigma[k] / (P.sigma[k] * P.sigma[k] + kappa)
        for j in range(P.f):
            P.y[j] += row[j] * t


@jit
def closed_form(P: Any) -> None:
    """x of all joints: the pseudoinverse, or damped by ``rule`` when that breaks ``limit``; kappa.

    J and right have been filled in. With weights, column = 1/sqrt(weight) turns the least |y| into the least
    x'diag(weight) x; with a limit for each joint, column = limit_i / limit. Where the last tick was damped,
    the SVD comes first: it will be needed again.
    Source: docs/theory/singularities.md.
    """
    factored = not P.kappa > 0.0 and _by_cholesky(P)
    P.kappa = 0.0
    if not factored:
        svd(P)
        damped(P, 0.0)
    if P.method == DAMPED and outside(P):
        if factored:
            svd(P)
        P.kappa = damping_factor(P)
        damped(P, P.kappa)
    scatter(P)
