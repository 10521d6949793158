"""The record of a plan that leads the null space: its rows, and where the tip is on it."""

from functools import cache
from typing import Any

import numpy as np


@cache
def plan_dtype() -> np.dtype[Any]:
    """The type of the record; the rows themselves are arrays beside it, whose addresses it holds.

    ``q_at`` are rows of joint values (rows, n), ``tip_at`` the position and rotation of the tip in each,
    (rows, 12), ``spacing`` [s] what lies between them. ``at`` is where the tip is, counted in rows, ``pace``
    how many rows it passes in a second. ``length`` [m] weighs rotations; 0 leaves them out. ``tip`` is that
    of the last tick.
    """
    whole = ("q_at", "tip_at", "rows", "begun")
    numbers = ("spacing", "length", "at", "pace")
    return np.dtype(
        [(name, "i8") for name in whole] + [(name, "f8") for name in numbers] + [("tip", "f8", (12,))],
        align=True,
    )
