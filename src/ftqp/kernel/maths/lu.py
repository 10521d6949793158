"""LU factorisation with partial pivoting, in place, of the leading part of a matrix."""

from typing import Any

from ftqp.kernel.jit import jit

SINGULAR = 1e-14
"""A pivot below this share of the matrix's largest entry counts as zero."""


@jit
def lu_factor(S: Any, n: int, pivots: Any) -> bool:
    """P S = L U in place, inverse pivots on the diagonal; False when a pivot counts as zero.

    A pivot that counts as zero leaves its equation out: ``lu_solve`` then gives that unknown the value 0. For
    a consistent system this is one of its solutions, so that dependent rows do no harm.
    """
    largest = 0.0
    for i in range(n):
        for j in range(n):
            largest = max(largest, abs(S[i, j]))
    regular = True
    for k in range(n):
        row, best = k, abs(S[k, k])
        for i in range(k + 1, n):
            if abs(S[i, k]) > best:
                row, best = i, abs(S[i, k])
        pivots[k] = row
        if row != k:
            for j in range(n):
                S[k, j], S[row, j] = S[row, j], S[k, j]
        if not best > SINGULAR * largest:
            regular = False
            S[k, k] = 0.0
            for i in range(k + 1, n):
                S[i, k] = 0.0
            continue
        inverse = 1.0 / S[k, k]
        S[k, k] = inverse
        for i in range(k + 1, n):
            f = S[i, k]
            if f != 0.0:
                f *= inverse
                S[i, k] = f
                for j in range(k + 1, n):
                    S[i, j] -= f * S[k, j]
    return regular


@jit
def determinant_sign(S: Any, n: int, pivots: Any) -> float:
    """1 or -1, the sign of the determinant of what ``lu_factor`` has factorised."""
    sign = 1.0
    for k in range(n):
        if S[k, k] < 0.0:
            sign = -sign
        if int(pivots[k]) != k:
            sign = -sign
    return sign


@jit
def lu_solve(S: Any, n: int, pivots: Any, x: Any) -> None:
    """x <- S^-1 x with the factors of ``lu_factor``."""
    for k in range(n):
        row = int(pivots[k])
        if row != k:
            x[k], x[row] = x[row], x[k]
    for i in range(n):
        s = x[i]
        for j in range(i):
            s -= S[i, j] * x[j]
        x[i] = s
    for i in range(n - 1, -1, -1):
        s = x[i]
        for j in range(i + 1, n):
            s -= S[i, j] * x[j]
        x[i] = s * S[i, i]
