"""All eigenvalues and eigenvectors of a symmetric matrix of any size that the kernel has."""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.elementary import mul_add
from ftqp.kernel.maths.side_by_side import WIDTH, load_lanes, store_lanes


@jit
def tridiagonal(S: Any, n: int, a: Any, b: Any) -> None:
    """Q' S Q = T by Householder reflections: a the diagonal of T, b[i] = T[i, i + 1]; S is lost.

    With v = x - alpha e_1 that maps the column x below the diagonal to alpha e_1, and beta = 2/v'v,

        S <- S - v w' - w v',  w = p - (beta/2)(p'v) v,  p = beta S v.

    Source: Golub and Van Loan 2013, algorithm 8.3.1.
    """
    for k in range(n - 2):
        size = 0.0
        for i in range(k + 1, n):
            size += S[i, k] * S[i, k]
        alpha = -sqrt(size) if S[k + 1, k] > 0.0 else sqrt(size)
        b[k] = alpha
        a[k] = S[k, k]
        S[k + 1, k] -= alpha
        length = 0.0
        for i in range(k + 1, n):
            length += S[i, k] * S[i, k]
        if not length > 0.0:
            continue
        beta = 2.0 / length
        along = 0.0
        for i in range(k + 1, n):
            s = 0.0
            for j in range(k + 1, i + 1):
                s += S[i, j] * S[j, k]
            for j in range(i + 1, n):
                s += S[j, i] * S[j, k]
            a[i] = beta * s
            along += a[i] * S[i, k]
        for i in range(k + 1, n):
            a[i] -= 0.5 * beta * along * S[i, k]
        for i in range(k + 1, n):
            for j in range(k + 1, i + 1):
                S[i, j] -= S[i, k] * a[j] + a[i] * S[j, k]
    if n > 1:
        a[n - 2] = S[n - 2, n - 2]
        b[n - 2] = S[n - 1, n - 2]
    if n > 0:
        a[n - 1], b[n - 1] = S[n - 1, n - 1], 0.0


@jit
def gram(A: Any, m: int, n: int, S: Any) -> int:
    """S <- A A' or A'A, whichever is smaller, of the leading (m, n) of A; its size, 0 when A is empty."""
    size = min(m, n)
    for i in range(size):
        for j in range(i + 1):
            s = 0.0
            if m <= n:
                for k in range(n):
                    s += A[i, k] * A[j, k]
            else:
                for k in range(m):
                    s += A[k, i] * A[k, j]
            S[i, j] = s
    return size


SWEEPS = 40
"""Implicit QL steps for one eigenvalue at most; two or three are usual."""
NEGLIGIBLE = 1e-16
"""An entry beside the diagonal below this share of its neighbours counts as zero. Half a unit of rounding of
that sum."""


@jit
def _basis(S: Any, n: int, Z: Any) -> None:
    """Z <- H_(n-3) ... H_0, the reflections whose vectors ``tridiagonal`` has left below the diagonal."""
    for i in range(n):
        for j in range(n):
            Z[i, j] = 1.0 if i == j else 0.0
    for k in range(n - 3, -1, -1):
        length = 0.0
        for i in range(k + 1, n):
            length += S[i, k] * S[i, k]
        if not length > 0.0:
            continue
        beta = 2.0 / length
        for r in range(k + 1, n):
            s = 0.0
            for i in range(k + 1, n):
                s += Z[r, i] * S[i, k]
            s *= beta
            for i in range(k + 1, n):
                Z[r, i] -= s * S[i, k]


@jit
def _ql(d: Any, e: Any, n: int, Z: Any, width: int) -> None:
    """Implicit QL steps with Wilkinson's shift on the tridiagonal (d, e).

    So many columns of Z take part, and those up to a whole block of lanes, which its rows have room for.
    """
    for low in range(n):
        for _ in range(SWEEPS):
            m = low
            while m < n - 1 and abs(e[m]) > NEGLIGIBLE * (abs(d[m]) + abs(d[m + 1])):
                m += 1
            if m == low:
                break
            g = (d[low + 1] - d[low]) / (2.0 * e[low])
            r = sqrt(g * g + 1.0)
            g = d[m] - d[low] + e[low] / (g + (r if g >= 0.0 else -r))
            s, c, p = 1.0, 1.0, 0.0
            cut = False
            for i in range(m - 1, low - 1, -1):
                f, b = s * e[i], c * e[i]
                r = sqrt(f * f + g * g)
                e[i + 1] = r
                if r == 0.0:
                    d[i + 1] -= p
                    e[m] = 0.0
                    cut = True
                    break
                s, c = f / r, g / r
                g = d[i + 1] - p
                r = (d[i] - g) * s + 2.0 * c * b
                p = s * r
                d[i + 1] = g + p
                g = c * r - b
                for k in range(0, width, WIDTH):
                    x, y = load_lanes(Z[i], k), load_lanes(Z[i + 1], k)
                    store_lanes(Z[i + 1], k, mul_add(s, x, c * y))
                    store_lanes(Z[i], k, mul_add(c, x, -(s * y)))
            if not cut:
                d[low] -= p
                e[low] = g
                e[m] = 0.0


@jit
def extreme_eigenvalues(S: Any, n: int, d: Any, e: Any) -> tuple[float, float]:
    """The smallest and the largest eigenvalue of S, of which the lower part is read and lost."""
    tridiagonal(S, n, d, e)
    _ql(d, e, n, S, 0)
    low, high = d[0], d[0]
    for i in range(1, n):
        low, high = min(low, d[i]), max(high, d[i])
    return low, high


@jit
def eigensystem(S: Any, n: int, d: Any, e: Any, Z: Any) -> None:
    """S = Z' diag(d) Z with orthonormal rows of Z, in no order; of S the lower part is read and lost.

    Rows of Z have room for whole blocks of lanes.

    Householder's reflections make S tridiagonal, implicit QL steps make that diagonal. Eigenvalues are
    accurate to rounding times the largest.
    Source: Golub and Van Loan 2013, algorithms 8.3.1 and 8.3.3.
    """
    tridiagonal(S, n, d, e)
    _basis(S, n, Z)
    _ql(d, e, n, Z, n)
