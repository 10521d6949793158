"""Memory of a study of a planar arm: its constants, and eight configurations side by side."""

from functools import cache
from typing import Any, Final

import numpy as np

WIDTH: Final = 8
"""Configurations side by side: as many as a block of joints has in ``side_by_side``."""
BOXES: Final = 2
"""Boxes of joint values that a study may tell apart: one, or one for each component of a self-motion."""
INTERVALS: Final = 2
"""Intervals of a joint in a box."""


@cache
def planar_dtype(n: int) -> np.dtype[Any]:
    """The type of the memory of a study of a planar arm of n joints.

    Arrays of (n WIDTH,) hold eight configurations, number k of joint i at i WIDTH + k; arrays of (WIDTH,) a
    number of each configuration.
    """
    joints, seats = (n * WIDTH,), (WIDTH,)
    return np.dtype(
        [
            ("link", "f8", (n,)),
            ("M", "f8", (n, n)),
            ("goal", "f8", (2,)),
            ("tolerance", "f8"),
            ("horizon", "f8"),
            ("success", "f8"),
            ("slowness", "f8"),
            ("per_speed", "f8"),
            *((name, "f8", joints) for name in ("px", "py", "mx", "my")),
            *((name, "f8", joints) for name in ("q", "free", "next", "k1", "k2", "k3", "k4")),
            *((name, "f8", joints) for name in ("trial", "single", "single_free", "single_rate")),
            *((name, "f8", seats) for name in ("h", "path", "time", "rate", "arrived", "fresh")),
            *((name, "f8", seats) for name in ("error", "det", "speed", "found", "stable", "regular")),
            ("single_error", "f8", seats),
            ("single_det", "f8", seats),
            ("single_size", "f8", seats),
            ("run", "i8", seats),
            ("steps", "i8", seats),
            ("slope", "f8", (n, n)),
            ("zero", "f8", seats),
            ("work", "f8", (n, n)),
            ("det_slope", "f8", (n,)),
            ("F", "f8", (n,)),
            *((name, "f8", (n,)) for name in ("y", "k_1", "k_2", "k_3", "f_0", "f_1", "here")),
            ("pivots", "f8", (n,)),
            ("box", "f8", (BOXES, n, INTERVALS, 2)),
            ("boxes", "i8"),
            ("by_joints", "i8"),
            ("margin", "f8", ((n + 1) * WIDTH,)),
            ("outside", "f8", ((n + 1) * WIDTH,)),
            ("failed", "f8", seats),
        ],
        align=True,
    )
