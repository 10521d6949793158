"""The reduced problem of the closed forms: the task over the joints that work, and memory to solve it.

    sum over working joints  A_i x_i = b - sum over failed joints  A_i rate_i,   x_i = column_i y_i

``J``, (m, f), holds column_i A_i of the working joints, and y is what the closed forms solve for. Rows of A
and b are expected with the characteristic length in them.
Source: Bedrossian 1993, equation 3, as J_f = J S: no J B J' is formed, which is singular with fewer working
joints than rows.
"""

from functools import cache
from typing import Any

import numpy as np

from ftqp.kernel.layout.enums import TASK_ROWS


@cache
def reduced_dtype(capacity: int) -> np.dtype[Any]:
    """The type of a reduced problem of up to ``capacity`` joints."""
    N, M = capacity, TASK_ROWS
    floats = {
        "A": (M, N),  # rows of its own, where they are not those of a planner's record
        "b": (M,),
        "rate": (N,),  # of a failed joint [rad/s or m/s]
        "column": (N,),  # scale of each unknown: 1, relative limit, or 1/sqrt(weight)
        "J": (M, N),
        "right": (M,),
        "V": (M, N),  # right singular vectors, one a row
        "Q": (M, M),
        "sigma": (M,),
        "square": (M,),
        "c": (M,),  # U' right
        "L": (M, M),
        "pivot": (M,),
        "w": (M,),
        "y": (N,),
        "x": (N,),
        "E": (N, N + 1),  # motion of the free-swinging joints, eliminated
    }
    scalars = ("limit", "kappa", "threshold", "wrist")
    sizes = ("n", "m", "f", "r", "rank", "method", "rule", "own_limits", "swings")
    fields: list[Any] = [(name, "f8", shape) for name, shape in floats.items()]
    fields += [(name, "f8") for name in scalars]
    fields += [(name, "i8", (N,)) for name in ("failed", "joint", "swinging")]
    fields += [(name, "i8") for name in sizes]
    return np.dtype(fields, align=True)


def memory(capacity: int) -> Any:
    """One zeroed reduced problem, (1,), with unscaled unknowns."""
    P = np.zeros(1, reduced_dtype(capacity))
    P["column"] = 1.0
    return P
