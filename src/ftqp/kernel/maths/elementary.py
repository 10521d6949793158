"""Elementary functions of formulas that serve one joint and eight neighbours at once.

In compiled code they take a float64 or eight in a vector register, in plain Python a number or an array.
"""

import math
from typing import Any

import numpy as np

from ftqp.kernel.jit import COMPILED


def sqrt(x: Any) -> Any:
    """The square root."""
    return np.sqrt(x) if isinstance(x, np.ndarray) else math.sqrt(x)


def floor(x: Any) -> Any:
    """The largest whole number <= x, as a float."""
    if isinstance(x, np.ndarray):
        return np.floor(x)
    return float(math.floor(x)) if math.isfinite(x) else x


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

    register_elementary(sqrt=sqrt, floor=floor, larger=larger, smaller=smaller, select=select, any_of=any_of)
