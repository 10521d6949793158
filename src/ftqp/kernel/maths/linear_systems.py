"""Sums of products, and linear systems of the leading part of a matrix: Cholesky, LU, Riccati."""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.jit import jit


@jit
def assign(x: Any, y: Any, n: int) -> None:
    """x <- y, the first n numbers."""
    for i in range(n):
        x[i] = y[i]


@jit
def plus_products(s: float, x: Any, y: Any, n: int) -> float:
    """s + x_1 y_1 + ... + x_n y_n, added in this order."""
    for i in range(n):
        s += x[i] * y[i]
    return s


@jit
def minus_products(s: float, x: Any, y: Any, n: int) -> float:
    """s - x_1 y_1 - ... - x_n y_n, likewise."""
    for i in range(n):
        s -= x[i] * y[i]
    return s


@jit
def factor(S: Any, n: int) -> bool:
    """Cholesky in place, lower, inverse diagonal; False when S is not positive definite."""
    for i in range(n):
        for j in range(i + 1):
            s = minus_products(S[i, j], S[i], S[j], j)
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
        x[i] = minus_products(x[i], S[i], x, i) * S[i, i]
    for i in range(n - 1, -1, -1):
        s = x[i]
        for k in range(i + 1, n):
            s -= S[k, i] * x[k]
        x[i] = s * S[i, i]


SINGULAR = 1e-14
"""A pivot below this share of the matrix's largest entry counts as zero. Of a smaller one all digits are
rounding: 45 units of it."""


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
        x[i] = minus_products(x[i], S[i], x, i)
    for i in range(n - 1, -1, -1):
        s = x[i]
        for j in range(i + 1, n):
            s -= S[i, j] * x[j]
        x[i] = s * S[i, i]


@jit
def product(X: Any, Y: Any, Z: Any, n: int) -> None:
    """Z = X Y; Z is neither of the two."""
    for i in range(n):
        Z[i, :n] = 0.0
        for k in range(n):
            x = X[i, k]
            if x != 0.0:
                for j in range(n):
                    Z[i, j] += x * Y[k, j]


@jit
def invert(X: Any, Y: Any, n: int, pivots: Any, column: Any) -> bool:
    """Y = X^-1, X destroyed; False where X is singular."""
    if not lu_factor(X, n, pivots):
        return False
    for j in range(n):
        column[:n] = 0.0
        column[j] = 1.0
        lu_solve(X, n, pivots, column)
        for i in range(n):
            Y[i, j] = column[i]
    return True


@jit
def begin_doubling(A: Any, G: Any, H: Any, W: Any, S: Any, T: Any, n: int, rate: float, pivots: Any,
                   column: Any) -> bool:  # fmt: skip
    """A, G, H of A'P + P A - P G P + H = 0 become those of the doubling's first iteration; False: singular.

    With A_r = A - r 1 and W = A_r' + H A_r^-1 G:  A_0 = 1 + 2 r W^-T,  G_0 = 2 r A_r^-1 G W^-1,
    H_0 = 2 r W^-1 H A_r^-1. S, T and W are memory.
    Source: Chu 2005, whose structure-preserving doubling it is; r > 0 is of the size of the closed loop's
    eigenvalues.
    """
    for i in range(n):
        for j in range(n):
            S[i, j] = A[i, j]
            W[i, j] = A[j, i]
        S[i, i] -= rate
        W[i, i] -= rate
    if not invert(S, T, n, pivots, column):  # T = A_r^-1
        return False
    product(T, G, S, n)  # S = A_r^-1 G
    for i in range(n):
        for k in range(n):
            x = H[i, k]
            if x != 0.0:
                for j in range(n):
                    W[i, j] += x * S[k, j]
    if not invert(W, A, n, pivots, column):  # A = W^-1
        return False
    product(S, A, G, n)
    product(H, T, W, n)
    product(A, W, H, n)
    for i in range(n):
        for j in range(n):
            T[i, j] = 2.0 * rate * A[j, i] + (1.0 if i == j else 0.0)
            G[i, j] *= 2.0 * rate
            H[i, j] *= 2.0 * rate
    for i in range(n):
        for j in range(n):
            A[i, j] = T[i, j]
    return True


@jit
def double(A: Any, G: Any, H: Any, W: Any, S: Any, T: Any, n: int, pivots: Any, column: Any) -> float:
    """One iteration; H tends to P. What it changed H by, over the size of H; inf where a matrix is singular.

    V = (1 + G H)^-1:  A' = A V A,  G' = G + A V G A^T,  H' = H + A^T H V A.
    """
    product(G, H, W, n)
    for i in range(n):
        W[i, i] += 1.0
    if not invert(W, S, n, pivots, column):  # S = V
        return inf
    product(S, A, T, n)  # T = V A
    product(S, G, W, n)  # W = V G
    product(A, W, S, n)  # S = A V G
    for i in range(n):
        for j in range(n):
            W[i, j] = plus_products(0.0, S[i], A[j], n)
    for i in range(n):
        for j in range(n):
            G[i, j] += 0.5 * (W[i, j] + W[j, i])
    product(H, T, S, n)  # S = H V A
    for i in range(n):
        W[i, :n] = 0.0
    for k in range(n):
        for i in range(n):
            x = A[k, i]
            if x != 0.0:
                for j in range(n):
                    W[i, j] += x * S[k, j]
    change = size = 0.0
    for i in range(n):
        for j in range(n):
            d = 0.5 * (W[i, j] + W[j, i])
            H[i, j] += d
            change = max(change, abs(d))
            size = max(size, abs(H[i, j]))
    product(A, T, S, n)
    for i in range(n):
        assign(A[i], S[i], n)
    return change / size if size < inf and size > 0.0 else inf
