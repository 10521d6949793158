"""The reduced problem of the closed forms: the task over the joints that work, and memory to solve it.

    sum over working joints  A_i x_i = b - sum over failed joints  A_i rate_i,   x_i = column_i y_i

``J`` (m, f) holds column_i A_i of the working joints, y is what the closed forms solve for.
Source: [Be] Bedrossian 1993, equation 3, as J_f = J S: no J B J' is formed, which is singular with fewer
working joints than rows. Rows of A and b are expected with the characteristic length in them.
"""

from typing import Any

import numpy as np

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import JOINTS, ROWS

N = JOINTS
DTYPE = np.dtype(
    [
        *(
            (name, "f8", shape)
            for name, shape in {
                "A": (ROWS, N),  # rows of its own, where they are not those of a planner's record
                "b": (ROWS,),
                "rate": (N,),  # of a failed joint [rad/s or m/s]
                "column": (N,),  # scale of each unknown: 1, relative limit, or 1/sqrt(weight)
                "J": (ROWS, N),
                "right": (ROWS,),
                "V": (ROWS, N),  # right singular vectors, one a row
                "Q": (ROWS, ROWS),
                "sigma": (ROWS,),
                "square": (ROWS,),
                "c": (ROWS,),  # U' right
                "L": (ROWS, ROWS),
                "pivot": (ROWS,),
                "w": (ROWS,),
                "y": (N,),
                "x": (N,),
                "E": (N, N + 1),  # motion of the free-swinging joints, eliminated
            }.items()
        ),
        *((name, "f8") for name in ("limit", "kappa", "threshold", "wrist")),
        *((name, "f8") for name in ("sigma_min", "manipulability", "condition")),
        *((name, "i8", (N,)) for name in ("failed", "joint", "swinging")),
        *((name, "i8") for name in ("n", "m", "f", "r", "rank", "method", "rule", "own_limits", "swings")),
    ],
    align=True,
)


def memory() -> Any:
    """One zeroed reduced problem with unscaled unknowns; its address is ``memory().ctypes.data``."""
    P = np.zeros(1, DTYPE)
    P["column"] = 1.0
    return P


@jit
def gather(P: Any, A: Any, b: Any, scale: float) -> None:
    """J, right and f from rows scale A and right sides scale b, the failed joints and their rates."""
    f = 0
    for i in range(P.n):
        if not P.failed[i]:
            P.joint[f] = i
            f += 1
    P.f = f
    for k in range(P.m):
        row, J = A[k], P.J[k]
        for j in range(f):
            i = P.joint[j]
            J[j] = scale * P.column[i] * row[i]
        right = b[k]
        if f < P.n:
            for i in range(P.n):
                if P.failed[i]:
                    right -= row[i] * P.rate[i]
        P.right[k] = scale * right


@jit
def scatter(P: Any) -> None:
    """x of all joints from y of the working ones and the rates of the failed ones."""
    for i in range(P.n):
        P.x[i] = P.rate[i]
    for j in range(P.f):
        i = P.joint[j]
        P.x[i] = P.column[i] * P.y[j]
