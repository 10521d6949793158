"""The stabilising solution of the algebraic Riccati equation by doubling, a matrix inverse an iteration."""

from math import inf
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.lu import lu_factor, lu_solve


@jit
def product(X: Any, Y: Any, Z: Any, n: int) -> None:
    """Z = X Y; Z is neither of the two."""
    for i in range(n):
        for j in range(n):
            Z[i, j] = 0.0
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
        for i in range(n):
            column[i] = 0.0
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
            s = 0.0
            for k in range(n):
                s += S[i, k] * A[j, k]
            W[i, j] = s
    for i in range(n):
        for j in range(n):
            G[i, j] += 0.5 * (W[i, j] + W[j, i])
    product(H, T, S, n)  # S = H V A
    for i in range(n):
        for j in range(n):
            W[i, j] = 0.0
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
        for j in range(n):
            A[i, j] = S[i, j]
    return change / size if size < inf and size > 0.0 else inf
