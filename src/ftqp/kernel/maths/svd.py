"""Singular values of a small matrix by one-sided Jacobi rotations."""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit

CUT_OFF = 1e-12
"""Singular values below this share of the largest count as zero. Rounding leaves 1e-16 of the largest, so
that four digits are known at the bound."""
SWEEPS = 30
"""Rounds over all pairs of rows at most; six rows take about six."""
ORTHOGONAL = 1e-15
"""Cosine between two rows below which they count as orthogonal. Four units of rounding, because a dot product
of some seven terms leaves no less."""


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
def singular_directions(W: Any, m: int, n: int, U: Any, sigma: Any) -> None:
    """W = U diag(sigma) V': the rows of W become sigma_k v_k', sigma descending.

    The method is one-sided Jacobi: plane rotations of pairs of rows until all are orthogonal, U collecting
    them. Small singular values keep their relative accuracy, which those of W W' would lose.
    W is (m, n) or larger, of fewer columns than rows some become zeros; U is (m, m) or larger.
    Source: Demmel and Veselić 1992.
    """
    for i in range(m):
        for j in range(m):
            U[i, j] = 1.0 if i == j else 0.0
    turned = U.T  # whose rows are the columns of U
    for _ in range(SWEEPS):
        rotated = False
        for p in range(m - 1):
            for r in range(p + 1, m):
                a, b, c = dot(W, p, p, n), dot(W, r, r, n), dot(W, p, r, n)
                if abs(c) <= ORTHOGONAL * sqrt(a * b):
                    continue
                rotated = True
                t = tangent(a, b, c)
                cosine = 1.0 / sqrt(1.0 + t * t)
                rotate(W, p, r, n, cosine, cosine * t)
                rotate(turned, p, r, m, cosine, cosine * t)
        if not rotated:
            break
    for k in range(m):
        sigma[k] = sqrt(dot(W, k, k, n))
    for k in range(m - 1):
        best = k
        for r in range(k + 1, m):
            if sigma[r] > sigma[best]:
                best = r
        if best != k:
            sigma[k], sigma[best] = sigma[best], sigma[k]
            for i in range(n):
                W[k, i], W[best, i] = W[best, i], W[k, i]
            for i in range(m):
                U[i, k], U[i, best] = U[i, best], U[i, k]


@jit
def svd(P: Any) -> None:
    """J = U diag(sigma) V' thin, r = min(m, f), sigma falling: V (r, f) by rows, c = U' right, rank.

    For a wide J (f >= m), U' J = X with orthogonal rows, so that V_k = X_k / sigma_k; of a tall J it is the
    same of J'.
    Source: Hestenes 1958.
    """
    m, f = P.m, P.f
    tall = f < m
    V, c, Q = P.V, P.c, P.Q
    r, length = (f, m) if tall else (m, f)
    for i in range(r):
        for k in range(length):
            V[i, k] = P.J[k, i] if tall else P.J[i, k]
    singular_directions(V, r, length, Q, P.sigma)
    P.r, P.rank = r, 0
    for i in range(r):
        inverse = 1.0 / P.sigma[i] if P.sigma[i] > 0.0 else 0.0
        s = 0.0
        for k in range(m):
            s += (V[i, k] if tall else Q[k, i]) * P.right[k]
        c[i] = s * inverse if tall else s
        for k in range(f):
            V[i, k] = Q[k, i] if tall else V[i, k] * inverse
        if P.sigma[i] > CUT_OFF * P.sigma[0]:
            P.rank = i + 1
