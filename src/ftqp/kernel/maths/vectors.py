"""Vectors of three numbers as tuples, which stay in registers."""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit

Vector = tuple[float, float, float]
ZERO = (0.0, 0.0, 0.0)
"""The vector that is none. A convention."""


@jit
def three(x: Any) -> Vector:
    """The first three numbers of an array."""
    return x[0], x[1], x[2]


@jit
def three_from(x: Any, at: int) -> Vector:
    """Three numbers of an array, from ``at`` on."""
    return x[at], x[at + 1], x[at + 2]


@jit
def column(X: Any, first: int, j: int) -> Vector:
    """Three numbers of column j of a matrix, from row ``first`` on."""
    return X[first, j], X[first + 1, j], X[first + 2, j]


@jit
def write(out: Any, at: int, a: Vector) -> None:
    """Three numbers of an array, from ``at`` on, <- a."""
    out[at], out[at + 1], out[at + 2] = a[0], a[1], a[2]


@jit
def add_to(out: Any, at: int, a: Vector) -> None:
    """Add a to three numbers of an array, from ``at`` on."""
    write(out, at, plus(three_from(out, at), a))


@jit
def plus(a: Vector, b: Vector) -> Vector:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@jit
def minus(a: Vector, b: Vector) -> Vector:
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@jit
def times(s: float, a: Vector) -> Vector:
    """s a."""
    return s * a[0], s * a[1], s * a[2]


@jit
def between(a: Vector, b: Vector, s: float) -> Vector:
    """a + s (b - a)."""
    return plus(a, times(s, minus(b, a)))


@jit
def inner(a: Vector, b: Vector) -> float:
    """a'b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@jit
def cross(a: Vector, b: Vector) -> Vector:
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@jit
def length(a: Vector) -> float:
    """|a|."""
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@jit
def rotated(R: Any, a: Vector) -> Vector:
    """R a of a matrix by rows, (9,)."""
    return (
        R[0] * a[0] + R[1] * a[1] + R[2] * a[2],
        R[3] * a[0] + R[4] * a[1] + R[5] * a[2],
        R[6] * a[0] + R[7] * a[1] + R[8] * a[2],
    )


@jit
def rotated_back(R: Any, a: Vector) -> Vector:
    """R'a of a matrix by rows, (9,)."""
    return (
        R[0] * a[0] + R[3] * a[1] + R[6] * a[2],
        R[1] * a[0] + R[4] * a[1] + R[7] * a[2],
        R[2] * a[0] + R[5] * a[1] + R[8] * a[2],
    )


@jit
def symmetric(I: Any, a: Vector) -> Vector:
    """I a of a symmetric matrix (xx xy xz yy yz zz)."""
    return (
        I[0] * a[0] + I[1] * a[1] + I[2] * a[2],
        I[1] * a[0] + I[3] * a[1] + I[4] * a[2],
        I[2] * a[0] + I[4] * a[1] + I[5] * a[2],
    )
