"""Memory of the point-to-point law on any arm: its constants, and eight configurations side by side."""

from functools import cache
from typing import Any, Final

import numpy as np

from ftqp.kernel.layout.enums import TASK_ROWS
from ftqp.kernel.layout.field_kinds import floats, integers, scalars

WIDTH: Final = 8
"""Configurations side by side: as many as a block of joints has in ``side_by_side``."""
LINE: Final = 64
"""Bytes of a line of the processor's cache."""
SHARE: Final = 0.5
"""c of the variable s with dq/ds = v / (c + |v|)."""
LONG_WAY: Final = 60.0
"""A run that went further without rest has none [rad]."""


@cache
def law_dtype(N: int) -> np.dtype[Any]:
    """The type of the memory of runs and lines of an arm of up to N joints.

    Arrays of (N WIDTH,) hold eight configurations, number k of joint i at i WIDTH + k; those of (6 N WIDTH,)
    eight matrices of m rows and n columns, number k of row r and column i at (r n + i) WIDTH + k; those of
    (WIDTH,) a number of each configuration. They come first, so that they do not cross lines of the cache.

    ``M``: the inverse of the weights, ``plain`` where it is the identity; ``planar``: all joints turn about
    parallel axes and ``link`` are the lengths between them [m]; ``unit``: mean length of a link [m];
    ``tolerance``: of a step [rad]; ``close``: how near a run must be to one of many configurations at the
    goal that is taken for its end [rad]; ``most``: steps before a run goes on by another method.
    """
    joints, rows, seats = (N * WIDTH,), (TASK_ROWS * WIDTH,), (WIDTH,)
    matrix, square = (TASK_ROWS * N * WIDTH,), (TASK_ROWS * TASK_ROWS * WIDTH,)
    return np.dtype(
        [
            *floats({name: joints for name in ("q", "free", "next", "k1", "k2", "k3", "k4", "trial")}),
            *floats({name: joints for name in ("eight", "eight_rate", "alone")}),
            *floats({"e": rows, "A": matrix, "P": matrix, "pivot": rows, "rhs": rows}),
            *floats({"factor": square, "turned": square, "way": rows, "wanted": rows}),
            *floats({name: seats for name in ("h", "path", "time", "gone", "rate", "arrived", "fresh")}),
            *floats({name: seats for name in ("error", "speed", "regular", "found", "reach", "zero")}),
            *floats({name: seats for name in ("one_error", "one_speed", "one_regular", "used", "failed")}),
            *floats({"margin": ((N + 1) * WIDTH,), "outside": ((N + 1) * WIDTH,)}),
            *scalars("f8", "unit tolerance close horizon success slowness per_speed spacing"),
            *scalars("i8", "most planar plain moves rows by_joints boxes intervals"),
            *integers({"run": seats, "steps": seats, "moving": (N,)}),
            *floats({"M": (N, N), "link": (N,)}),
            *floats({name: (N,) for name in ("here", "there", "v", "w", "y", "pivots")}),
            *floats({name: (N,) for name in ("k_1", "k_2", "k_3", "f_0", "f_1")}),
            *floats({"slope": (N, N), "work": (N, N)}),
        ],
        align=True,
    )


def law_memory(N: int) -> Any:
    """Such memory, (1,), of zeros, its first fields at the begin of lines of the processor's cache."""
    size = law_dtype(N).itemsize
    room = np.zeros(size + LINE, np.uint8)
    begin = -room.ctypes.data % LINE
    return room[begin : begin + size].view(law_dtype(N))
