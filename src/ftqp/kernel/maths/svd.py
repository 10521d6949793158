"""Singular values of a small matrix by one-sided Jacobi rotations."""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit

CUT_OFF = 1e-12
"""Singular values below this share of the largest count as zero. Rounding leaves 1e-16 of the largest, so
that four digits are known at the bound."""
SWEEPS = 30
"""Rounds over all pairs of rows at most; some six are usual."""
ORTHOGONAL = 1e-30
"""Squared cosine between two rows below which they are left alone. Cosines of 1e-15, four units of rounding,
are what a dot product leaves."""
SETTLED = 1e-17
"""Largest squared cosine of a sweep after which, converging quadratically, nothing is left to do. The next
sweep would have the square of it, below rounding."""


@jit
def dot(X: Any, i: int, j: int, length: int) -> float:
    """Row i times row j."""
    a, b = X[i], X[j]
    s = 0.0
    for k in range(length):
        s += a[k] * b[k]
    return s


@jit
def rotate(X: Any, i: int, j: int, length: int, c: float, s: float) -> None:
    """Rows (i, j) <- (c i - s j, s i + c j)."""
    a, b = X[i], X[j]
    for k in range(length):
        x, y = a[k], b[k]
        a[k] = c * x - s * y
        b[k] = s * x + c * y


@jit
def tangent(a: float, b: float, p: float) -> float:
    """Tangent of the smaller angle that makes rows of squared norms a, b and product p orthogonal."""
    zeta = (b - a) / (2.0 * p)
    if abs(zeta) > 1e150:
        return 0.5 / zeta
    t = 1.0 / (abs(zeta) + sqrt(1.0 + zeta * zeta))
    return t if zeta >= 0.0 else -t


@jit
def _orthogonalise(P: Any, r: int, length: int, tall: bool) -> None:
    """Rotate the r rows of V until they are orthogonal; c (or Q) takes part, ``square`` is their |.|^2.

    Norms are updated by the rotations and computed anew at every sweep, and where digits were lost.
    """
    V, c, square = P.V, P.c, P.square
    for _ in range(SWEEPS):
        worst = 0.0
        for i in range(r):
            square[i] = dot(V, i, i, length)
        for i in range(r - 1):
            for j in range(i + 1, r):
                a, b = square[i], square[j]
                p = dot(V, i, j, length)
                if p * p <= ORTHOGONAL * a * b:
                    continue
                worst = max(worst, p * p / (a * b) if a * b > 0.0 else 1.0)
                t = tangent(a, b, p)
                cosine = 1.0 / sqrt(1.0 + t * t)
                sine = t * cosine
                rotate(V, i, j, length, cosine, sine)
                square[i], square[j] = a - t * p, b + t * p
                if square[i] < 0.1 * a:
                    square[i] = dot(V, i, i, length)
                if square[j] < 0.1 * b:
                    square[j] = dot(V, j, j, length)
                if tall:
                    rotate(P.Q, i, j, r, cosine, sine)
                else:
                    x, y = c[i], c[j]
                    c[i] = cosine * x - sine * y
                    c[j] = sine * x + cosine * y
        if worst <= SETTLED:
            break
    for i in range(r):
        square[i] = dot(V, i, i, length)


@jit
def _swap(P: Any, i: int, j: int, length: int) -> None:
    """Exchange two singular triplets."""
    P.sigma[i], P.sigma[j] = P.sigma[j], P.sigma[i]
    P.c[i], P.c[j] = P.c[j], P.c[i]
    for k in range(length):
        x = P.V[i, k]
        P.V[i, k] = P.V[j, k]
        P.V[j, k] = x


@jit
def svd(P: Any) -> None:
    """J = U diag(sigma) V' thin, r = min(m, f), sigma falling: V (r, f) by rows, c = U' right, rank.

    For a wide J (f >= m), Q J = X with orthogonal rows, so sigma_k = |X_k|, V_k = X_k / sigma_k and
    c = Q right. For a tall J it is the same of J', so V = Q and c_k = X_k right / sigma_k. Small singular
    values are accurate relative to themselves where scaling rows explains the condition.
    Source: Hestenes 1958; Demmel and Veselić 1992.
    """
    m, f = P.m, P.f
    tall = f < m
    V, c = P.V, P.c
    if tall:
        r, length = f, m
        for i in range(r):
            for k in range(m):
                V[i, k] = P.J[k, i]
            for j in range(r):
                P.Q[i, j] = 1.0 if i == j else 0.0
    else:
        r, length = m, f
        for i in range(r):
            row, J = V[i], P.J[i]
            for k in range(f):
                row[k] = J[k]
            c[i] = P.right[i]
    _orthogonalise(P, r, length, tall)
    for i in range(r):
        s = sqrt(P.square[i])
        P.sigma[i] = s
        inverse = 1.0 / s if s > 0.0 else 0.0
        if tall:
            t = 0.0
            for k in range(m):
                t += V[i, k] * P.right[k]
            c[i] = t * inverse
            for k in range(f):
                V[i, k] = P.Q[i, k]
        else:
            row = V[i]
            for k in range(f):
                row[k] *= inverse
    for i in range(r - 1):
        best = i
        for j in range(i + 1, r):
            if P.sigma[j] > P.sigma[best]:
                best = j
        if best != i:
            _swap(P, i, best, f)
    P.r = r
    rank = 0
    for i in range(r):
        if P.sigma[i] > CUT_OFF * P.sigma[0]:
            rank = i + 1
    P.rank = rank
