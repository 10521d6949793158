"""Cholesky factorisation in place, with inverse diagonal so that substitution multiplies."""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit


@jit
def factor(S: Any, n: int) -> bool:
    """Cholesky in place, lower, inverse diagonal; False when S is not positive definite."""
    for i in range(n):
        for j in range(i + 1):
            s = S[i, j]
            for k in range(j):
                s -= S[i, k] * S[j, k]
            if i == j:
                if not s > 0.0:
                    return False
                S[i, i] = 1.0 / sqrt(s)
            else:
                S[i, j] = s * S[j, j]
    return True


@jit
def solve_factored(S: Any, n: int, x: Any) -> None:
    """x <- S^-1 x with the factor of ``factor``."""
    for i in range(n):
        s = x[i]
        for k in range(i):
            s -= S[i, k] * x[k]
        x[i] = s * S[i, i]
    for i in range(n - 1, -1, -1):
        s = x[i]
        for k in range(i + 1, n):
            s -= S[k, i] * x[k]
        x[i] = s * S[i, i]
