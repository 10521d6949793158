"""The room of constraints: points on their side of a plane, axes in a cone, and rows of the user's own."""

from ftqp.kernel.layout.field_kinds import Fields, floats, integers, scalars
from ftqp.kernel.layout.rows import KEEPS, OWN_ROWS


def keeps_fields(N: int) -> Fields:
    """What ``ftqp.kernel.rows.keep_rows`` and ``own_rows`` need.

    ``body``: the joint whose frame the point ``place`` moves with; ``normal``'p >= ``offset`` is its side,
    along W; ``brake``: how hard the arm can brake it there [m/s2]; ``distance``: as of the last tick [m].
    Where ``turns``, ``place`` is an axis of the frame that stays within ``offset`` of ``normal`` [rad].
    ``asked``: how many rows the planner asks for, those of tasks included. ``own_C``, ``own_l``, ``own_u``:
    the rows of the user's own, ``own`` of them.
    """
    return [
        *scalars("i8", "asked count own"),
        *integers(dict.fromkeys(("body", "turns"), (KEEPS,))),
        *floats(dict.fromkeys(("offset", "brake", "distance"), (KEEPS,))),
        *floats(dict.fromkeys(("place", "normal"), (KEEPS, 3))),
        *floats({"own_C": (OWN_ROWS, N), "own_l": (OWN_ROWS,), "own_u": (OWN_ROWS,)}),
    ]
