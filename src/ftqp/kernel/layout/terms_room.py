"""The room of further tasks: what is asked of other points of the arm, beside the task of the tip."""

from enum import IntEnum

from ftqp.kernel.layout.enums import TASK_ROWS
from ftqp.kernel.layout.field_kinds import Fields, floats, integers, scalars

TERMS = 8
"""The most tasks that a planner may have beside that of the tip. A convention, which sizes memory."""


class TermKind(IntEnum):
    """What a further task asks for."""

    POINT = 0
    AXIS = 1
    MASS = 2
    JOINTS = 3
    OWN = 4


POINT, AXIS, MASS, JOINT_PLACES, OWN = map(int, TermKind)


def terms_fields(N: int) -> Fields:
    """Least-squares terms of the objective, see ``ftqp.kernel.rows.further_tasks``.

    ``body``: the joint whose frame a point or an axis moves with, -1 is the base; ``rows``: one bit for each
    of x, y, z; ``place`` and ``axis``: in that frame; ``goal``: where the point should be, or what the axis
    should point along, or at where ``towards``; ``rate``: velocity of the goal. ``q_goal`` and ``share``: of
    a task of joints. ``J`` and ``b``: of one that the user fills in, ``m`` rows. ``error``: as of the last
    tick. ``rows_of``: memory of the rows of one term.
    """
    return [
        *scalars("i8", "count"),
        *integers(dict.fromkeys(("kind", "body", "rows", "towards", "m"), (TERMS,))),
        *floats(dict.fromkeys(("weight", "kp", "kv"), (TERMS,))),
        *floats(dict.fromkeys(("place", "axis", "goal", "rate", "error"), (TERMS, 3))),
        *floats(dict.fromkeys(("q_goal", "share"), (TERMS, N))),
        *floats({"J": (TERMS, TASK_ROWS, N), "b": (TERMS, TASK_ROWS), "rows_of": (TASK_ROWS, N)}),
    ]
