"""Memory of the point-to-point law on any arm: weights, steps of a run or a line, slopes."""

from functools import cache
from typing import Any

import numpy as np

from ftqp.kernel.layout.enums import TASK_ROWS
from ftqp.kernel.layout.field_kinds import floats, scalars


@cache
def law_dtype(N: int) -> np.dtype[Any]:
    """The type of the memory of runs and lines of an arm of up to N joints.

    ``M``: the inverse of the weights; ``free``: 1 for joints that move; ``unit``: mean length of a link [m];
    ``tolerance``: of a step. ``P`` = M A', ``B`` = A M A' or its factor, ``rhs`` and ``wanted``: rates of the
    task; ``miss``, ``speed`` and ``regular``: |e|, |v| and the least pivot of B over the largest, of the last
    rates. ``q`` to ``k4``: a step; ``trial``, ``here`` and ``there``: searches; ``slope`` to ``y``: Newton.
    """
    return np.dtype(
        [
            *scalars("f8", "unit tolerance miss speed regular"),
            *floats({"M": (N, N), "free": (N,), "P": (N, TASK_ROWS), "B": (TASK_ROWS, TASK_ROWS)}),
            *floats({"rhs": (TASK_ROWS,), "wanted": (TASK_ROWS,), "column": (TASK_ROWS,)}),
            *floats({name: (N,) for name in ("q", "next", "k1", "k2", "k3", "k4")}),
            *floats({name: (N,) for name in ("trial", "here", "there", "v", "pivots", "y")}),
            *floats({"slope": (N, N), "work": (N, N)}),
        ],
        align=True,
    )
