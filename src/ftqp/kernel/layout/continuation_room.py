"""Memory of motions after a failure: which joints have failed and how, limits, and work memory."""

from functools import cache
from typing import Any

import numpy as np

from ftqp.kernel.layout.enums import TASK_ROWS
from ftqp.kernel.layout.field_kinds import floats, integers, scalars
from ftqp.kernel.layout.rooms import qp_fields
from ftqp.kernel.layout.rows import CLEARANCES

FAILED_JOINTS = 2
"""The most joints that fail."""
FACTS = 7
"""Numbers that a continuation leaves: see ``continuation_dtype``."""


@cache
def continuation_dtype(N: int) -> np.dtype[Any]:
    """The type of the memory of continuations of an arm of up to N joints.

    ``failed``: the joints that fail, -1 for none; ``begin`` and ``speed``: where each was when it failed, and
    with which speed it then begins to brake [rad/s or m/s]; ``share``: what is left of its speed limit where
    it is not locked, negative where it is. ``dt``: of the path [s]; ``near`` and ``turned``: errors from
    which a sample is lost [m, rad]; ``whole``: whether a lost motion is followed to the end all the same.
    ``free`` and ``moving``: joints that move, and how many. ``q_min`` to ``a_max``: limits; ``weight`` and
    ``caution``: of the task, and the share of the way to a limit that one sample may take.

    Of the last motion ``sample`` says where it was lost, ``position`` and ``rotation`` the worst errors
    [m, rad], ``margin`` the least distance of a joint that moves from its limits, ``hurry`` the largest
    |v| / v_max, ``fast`` where that first was over 1, and ``clearance`` the least distance of two bodies that
    are to be kept apart, inf without any [m].
    """
    return np.dtype(
        [
            *scalars("i8", "moving whole sample fast"),
            *scalars("f8", "dt near turned weight caution share position rotation margin hurry clearance"),
            *integers({"failed": (FAILED_JOINTS,), "free": (N,)}),
            *floats({"begin": (FAILED_JOINTS,), "speed": (FAILED_JOINTS,)}),
            *floats({name: (N,) for name in ("q_min", "q_max", "v_max", "a_max", "here", "step")}),
            *floats({"B": (TASK_ROWS, TASK_ROWS), "rhs": (TASK_ROWS,), "pivots": (TASK_ROWS,)}),
            ("qp", np.dtype(qp_fields(N, TASK_ROWS, CLEARANCES), align=True)),
        ],
        align=True,
    )
