"""Extreme eigenvalues of a symmetric matrix: what the scaling of the network's QP depends on."""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit

BISECTIONS = 60
"""Halvings of the interval that holds an eigenvalue; fewer when it is down to rounding."""


@jit
def tridiagonal(S: Any, n: int, a: Any, b: Any) -> None:
    """Q' S Q = T by Householder reflections: a the diagonal of T, b[i] the square of T[i, i + 1]; S is lost.

    With v = x - alpha e_1 that maps the column x below the diagonal to alpha e_1, and beta = 2/v'v,

        S <- S - v w' - w v',  w = p - (beta/2)(p'v) v,  p = beta S v.

    Source: Golub and Van Loan 2013, algorithm 8.3.1.
    """
    for k in range(n - 2):
        size = 0.0
        for i in range(k + 1, n):
            size += S[i, k] * S[i, k]
        alpha = -sqrt(size) if S[k + 1, k] > 0.0 else sqrt(size)
        b[k] = size
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
        b[n - 2] = S[n - 1, n - 2] * S[n - 1, n - 2]
    a[n - 1] = S[n - 1, n - 1]


@jit
def _any_below(a: Any, b: Any, n: int, x: float) -> bool:
    """Whether T has an eigenvalue below x: a negative pivot of T - x I."""
    pivot = 1.0
    for i in range(n):
        pivot = a[i] - x - (b[i - 1] / pivot if i > 0 else 0.0)
        if not pivot > 0.0:
            return True
    return False


@jit
def _least(a: Any, b: Any, n: int, low: float, high: float) -> float:
    """The smallest eigenvalue of T, which lies in [low, high]."""
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if not (low < middle and middle < high):
            break
        if _any_below(a, b, n, middle):
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


@jit
def extreme_eigenvalues(S: Any, n: int, a: Any, b: Any) -> tuple[float, float]:
    """The smallest and the largest eigenvalue of the symmetric S, of which the lower part is read and lost.

    Bisection on the signs of the pivots of T - x I (Sturm sequence) within Gershgorin's bounds.

    Args:
        S: Symmetric matrix, of which the leading (n, n) counts.
        n: Its size.
        a: Memory, (n,).
        b: Memory, (n,).
    """
    tridiagonal(S, n, a, b)
    low, high = a[0], a[0]
    for i in range(n):
        reach = (sqrt(b[i - 1]) if i > 0 else 0.0) + (sqrt(b[i]) if i < n - 1 else 0.0)
        low, high = min(low, a[i] - reach), max(high, a[i] + reach)
    margin = 1e-15 * max(abs(low), abs(high))
    low, high = low - margin, high + margin
    least = _least(a, b, n, low, high)
    for i in range(n):
        a[i] = -a[i]
    return least, -_least(a, b, n, -high, -low)


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
