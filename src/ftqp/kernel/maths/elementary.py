"""Elementary functions of formulas that serve one joint and eight neighbours at once.

In compiled code they take a float64 or eight in a vector register, in plain Python a number or an array.
"""

import math
from math import inf, pi
from typing import Any

import numpy as np

from ftqp.core.pose import ORTHONORMAL_TOLERANCE
from ftqp.kernel.jit import COMPILED, carray, jit, pointer

MOST_TURNS = 1e9
"""An angle of more turns is none: no encoder gives it. Rounding alone makes 1e-6 rad of a larger one, so that
its sine is none."""


def sqrt(x: Any) -> Any:
    """The square root."""
    return np.sqrt(x) if isinstance(x, np.ndarray) else math.sqrt(x)


def floor(x: Any) -> Any:
    """The largest whole number <= x, as a float."""
    if isinstance(x, np.ndarray):
        return np.floor(x)
    return float(math.floor(x)) if math.isfinite(x) else x


def mul_add(x: Any, y: Any, z: Any) -> Any:
    """x y + z, rounded once where the processor has an instruction for that, as in formulas of one joint."""
    return x * y + z


def larger(x: Any, y: Any) -> Any:
    """The larger of two numbers; of those that do not compare, the first."""
    return select(y > x, y, x)


def smaller(x: Any, y: Any) -> Any:
    """The smaller of two numbers; of those that do not compare, the first."""
    return select(y < x, y, x)


def select(condition: Any, x: Any, y: Any) -> Any:
    """x where the condition holds, else y; both are computed."""
    return np.where(condition, x, y) if isinstance(condition, np.ndarray) else x if condition else y


def any_of(condition: Any) -> Any:
    """Whether a condition holds for one of the joints."""
    return bool(np.any(condition))


if COMPILED:
    from ftqp.kernel.compiled.making.lane_numbers import register_elementary

    register_elementary(
        sqrt=sqrt, floor=floor, mul_add=mul_add, larger=larger, smaller=smaller, select=select, any_of=any_of
    )


@jit
def is_finite(x: float) -> bool:
    """|x| < inf: false for NaN and infinities.

    numba's ``math.isfinite`` compares x - x with itself; with reassociation allowed, the compiler folds that
    into 0 when x is a sum, and NaN passes.
    """
    return abs(x) < inf


_FLOAT = np.dtype(np.float64)


@jit
def whole_turns(angle: float) -> float:
    """How many whole turns an angle is off, so that at most half a turn is left; 0 for what is no angle."""
    turns = angle / (2.0 * pi)
    return float(int(turns + (0.5 if turns >= 0.0 else -0.5))) if abs(turns) < MOST_TURNS else 0.0


@jit
def matrix_view(vector: Any, first: int, rows: int, columns: int) -> Any:
    """The numbers of a vector from ``first`` on as a matrix by rows; the caller keeps the vector alive."""
    return carray(pointer(vector.ctypes.data + 8 * first), (rows, columns), _FLOAT)


@jit
def vector_view(matrix: Any) -> Any:
    """The numbers of a matrix, row by row."""
    return carray(pointer(matrix.ctypes.data), (matrix.size,), _FLOAT)


@jit
def is_rotation(pose: Any) -> bool:
    """|R'R - I| <= ORTHONORMAL_TOLERANCE entry by entry and det R > 0, for the R of a packed pose, (12+,).

    det R is r0 . (r1 x r2) of its columns, which is 1 or -1 where R'R = I.
    """
    a0, a1, a2 = pose[0], pose[4], pose[8]
    b0, b1, b2 = pose[1], pose[5], pose[9]
    c0, c1, c2 = pose[2], pose[6], pose[10]
    off = max(
        max(abs(a0 * a0 + a1 * a1 + a2 * a2 - 1.0), abs(b0 * b0 + b1 * b1 + b2 * b2 - 1.0)),
        max(abs(c0 * c0 + c1 * c1 + c2 * c2 - 1.0), abs(a0 * b0 + a1 * b1 + a2 * b2)),
    )
    off = max(off, max(abs(a0 * c0 + a1 * c1 + a2 * c2), abs(b0 * c0 + b1 * c1 + b2 * c2)))
    volume = a0 * (b1 * c2 - b2 * c1) + a1 * (b2 * c0 - b0 * c2) + a2 * (b0 * c1 - b1 * c0)
    return bool(off <= ORTHONORMAL_TOLERANCE and volume > 0.0)


@jit
def has_last_row(a: float, b: float, c: float, d: float) -> bool:
    """Whether the last row of a pose is 0 0 0 1 to ORTHONORMAL_TOLERANCE."""
    off = max(max(abs(a), abs(b)), max(abs(c), abs(d - 1.0)))
    return bool(off <= ORTHONORMAL_TOLERANCE)
