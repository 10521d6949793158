"""Whether a linear system x' = S x dies out."""

from math import sqrt
from typing import Any, Final

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.lu import lu_factor, lu_solve

SQUARINGS: Final = 24
"""Of the Cayley transform, until its powers have grown or died."""


@jit
def dies_out(L: Any, k: int) -> bool:
    """Whether all eigenvalues of ``slope``, (k, k), have negative real parts; the slopes are lost.

    Of two unknowns by det > 0 and trace < 0, of more by the powers of the Cayley transform
    C = (s - S)^-1 (s + S): they die out just where S is stable, as |(s + x)/(s - x)| < 1 where Re x < 0.
    """
    S, B = L.slope, L.work
    if k == 1:
        return S[0, 0] < 0.0
    if k == 2:
        return S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0] > 0.0 and S[0, 0] + S[1, 1] < 0.0
    scale = largest_of(S, k)
    if not scale > 0.0:
        return False
    for i in range(k):
        for j in range(k):
            B[i, j] = (scale if i == j else 0.0) - S[i, j]
            S[i, j] += scale if i == j else 0.0
    if not lu_factor(B, k, L.pivots):
        return False
    for j in range(k):
        for i in range(k):
            L.y[i] = S[i, j]
        lu_solve(B, k, L.pivots, L.y)
        for i in range(k):
            S[i, j] = L.y[i]
    for _ in range(SQUARINGS):
        size = 0.0
        for i in range(k):
            for j in range(k):
                s = 0.0
                for l in range(k):
                    s += S[i, l] * S[l, j]
                B[i, j] = s
                size += s * s
        for i in range(k):
            for j in range(k):
                S[i, j] = B[i, j]
        if not size < 1e30:
            return False
        if size < 1e-6:
            return True
    return sqrt(size) < 1e-3


@jit
def largest_of(S: Any, k: int) -> float:
    """The largest entry of S, (k, k), without its sign."""
    scale = 0.0
    for i in range(k):
        for j in range(k):
            scale = max(scale, abs(S[i, j]))
    return scale
