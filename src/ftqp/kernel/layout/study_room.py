"""The record of a study: an arm, the rows of its task, a goal, and memory to look at many configurations."""

from functools import cache
from typing import Any

import numpy as np

from ftqp.kernel.layout.enums import TASK_ROWS
from ftqp.kernel.layout.field_kinds import Fields, floats, integers, scalars
from ftqp.kernel.layout.record import ARM_ROOMS
from ftqp.kernel.layout.rooms import ROOMS

GOAL_SIZE = 12
"""Numbers of a goal: the pose's upper three rows, by rows."""
SCENE_ROOMS = ("ahead", "scene")
"""The rooms of what an arm keeps clear of; there are no pairs where nobody asked."""


def study_fields(N: int) -> Fields:
    """The room of a study.

    ``rows``: which m of x, y, z, rx, ry, rz count; ``turns``: whether rotation is among them; ``length``:
    what angular rows are multiplied by [m]. ``axis``: of the orientation only the tool's z axis counts, and
    rx and ry are the shortest turn of it along the goal's x and y axes; derivatives of A are not known then.
    ``held``: joints that stand still; ``wraps``: joints whose values
    count modulo one turn; ``q_min`` and ``q_max``: where curves end. ``goal``: the pose. ``full``: its error,
    not scaled; ``e`` and ``A``: error and Jacobian of the rows, scaled. ``W``: diag(sigma) V' of A, ``U`` and
    ``sigma`` its other parts. ``dq``: a step; ``tangent``, ``middle`` and ``ahead``: directions of a curve at
    a point, behind half a step and behind the step; ``first``: at its start. ``step``: largest step of a
    curve [rad or m]; ``tolerance``: error that counts as none [m]; ``side``: sign of det [A; tangent];
    ``cosine`` and ``side_ahead``: turn of the tangent in a step, and the side behind it.

    Of the last curve ``closed`` says how it ended (``CurveEnd``), ``crossed`` whether it passed a crossing,
    ``winding`` the turns of each joint on one round, ``arc`` its length and ``least`` its smallest sigma.
    """
    return [
        *scalars("i8", "m turns axis closed crossed"),
        *scalars("f8", "length tolerance step side cosine side_ahead arc least"),
        *integers({"rows": (TASK_ROWS,), "held": (N,), "wraps": (N,), "winding": (N,)}),
        *floats(
            {
                "goal": (GOAL_SIZE,),
                "q_min": (N,),
                "q_max": (N,),
                "full": (6,),
                "e": (TASK_ROWS,),
                "A": (TASK_ROWS, N),
                "W": (TASK_ROWS, N),
                "U": (TASK_ROWS, TASK_ROWS),
                "sigma": (TASK_ROWS,),
                "dq": (N,),
                "tangent": (N,),
                "middle": (N,),
                "ahead": (N,),
                "first": (N,),
                "square": (N, N),
                "pivot": (N,),
            }
        ),
    ]


@cache
def study_dtype(capacity: int) -> np.dtype[Any]:
    """The type of the record of a study of an arm of up to ``capacity`` joints.

    Its own room comes first: numba takes a record that begins as another one for a kind of that.
    """
    rooms = {"study": study_fields, **{name: ROOMS[name] for name in (*ARM_ROOMS, *SCENE_ROOMS)}}
    return np.dtype(
        [(name, np.dtype(fields(capacity), align=True)) for name, fields in rooms.items()], align=True
    )
