"""Left singular directions of a small wide matrix, row by row and in place."""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.svd import dot, rotate, tangent

SWEEPS = 30
"""Rounds over all pairs of rows at most; six rows take about six."""
ORTHOGONAL = 1e-15
"""Cosine between two rows below which they count as orthogonal. Four units of rounding, because a dot product
of some seven terms leaves no less."""


@jit
def singular_directions(W: Any, m: int, n: int, U: Any, sigma: Any) -> None:
    """W = U diag(sigma) V': the rows of W become sigma_k v_k', sigma descending.

    The method is one-sided Jacobi: plane rotations of pairs of rows until all are orthogonal, U collecting
    them. Small singular values keep their relative accuracy, which those of W W' would lose.
    Source: Demmel and Veselić 1992.

    Args:
        W: (m, n) or larger; overwritten by diag(sigma) V'.
        m: How many rows of W count.
        n: How many columns count; fewer than m leave rows of zeros.
        U: (m, m) or larger, filled.
        sigma: (m,) or longer, filled.
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
