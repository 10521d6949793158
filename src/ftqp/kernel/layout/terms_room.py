"""The room of further tasks: what is asked of other points of the arm, beside the task of the tip."""

from enum import IntEnum

from ftqp.kernel.layout.enums import TASK_ROWS
from ftqp.kernel.layout.field_kinds import Fields, floats, integers, scalars

TERMS = 8
"""The most tasks that a planner may have beside that of the tip. A convention, which sizes memory."""
PLACES_OF = TERMS + 1
"""Places for them: the one behind the planner's own draws the tip to rows that were given up."""


class TermKind(IntEnum):
    """What a further task asks for."""

    FRAME = 0
    AXIS = 1
    MASS = 2
    JOINTS = 3
    OWN = 4


FRAME, AXIS, MASS, JOINT_PLACES, OWN = map(int, TermKind)
BESIDE_TIP, BEFORE_SCHEME = 1, 2
"""How a term stands in the objective where it does not by its weight alone, which is 0."""


def terms_fields(N: int) -> Fields:
    """Further tasks, see ``ftqp.kernel.rows.further_tasks`` and ``ftqp.kernel.rows.task_terms``.

    ``own``: how many the planner has; one more counts while rows are given up, see
    ``ftqp.kernel.rows.rows_given_up``.

    ``hard``: rows of C, before the task of the tip, in place of terms of the objective. ``shares``: terms as
    firm as the rows of the tip, beside which they stand, or before the scheme; ``shared``: how many stand
    beside the tip, ``stands``: the firmness 1/soft at which they are in H, negative while no terms are;
    ``bends``: whether what their errors bend by
    counts; ``added``: by how much tr H has grown. ``required``: counts for the status; ``missed``: how many
    of those the command misses, ``worst``: the largest error of one as a share of its tolerance. ``body``:
    the joint whose frame a point or an axis moves with, -1 is the base; ``other``: the one that its goal
    moves with; ``rows``: one bit for each of x, y, z, rx, ry, rz. ``place`` and ``axis``: in the frame of
    ``body``; ``goal``: where the point should be, or what the axis should point at, where ``towards``, in the
    frame of ``other``, or else the direction that it should have along W; ``turn``: how ``body`` should stand
    in ``other``. ``rate`` and ``rate_change``: twist and acceleration of a goal along W. ``length``: what a
    radian counts [m]. ``q_goal`` and ``share``: of a task of joints. ``J`` and ``b``: of one that the user
    fills in, ``m`` rows; of the others as of the last tick. ``error``: as of the last tick; ``asked``: of the
    rows; ``slack``: J x - b of the command.
    """
    return [
        *scalars("i8", "count own shared bends missed"),
        *scalars("f8", "length stands added worst"),
        *integers(dict.fromkeys(("kind", "body", "other", "rows", "towards", "m"), (PLACES_OF,))),
        *integers(dict.fromkeys(("hard", "shares", "required"), (PLACES_OF,))),
        *floats(dict.fromkeys(("weight", "kp", "kv"), (PLACES_OF,))),
        *floats(dict.fromkeys(("place", "axis", "goal"), (PLACES_OF, 3))),
        *floats(dict.fromkeys(("error", "rate", "rate_change", "asked", "slack"), (PLACES_OF, TASK_ROWS))),
        *floats({"turn": (PLACES_OF, 9)}),
        *floats(dict.fromkeys(("q_goal", "share"), (PLACES_OF, N))),
        *floats({"J": (PLACES_OF, TASK_ROWS, N), "b": (PLACES_OF, TASK_ROWS)}),
    ]
