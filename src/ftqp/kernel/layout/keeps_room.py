"""The room of points that are kept on their side of a plane."""

from ftqp.kernel.layout.field_kinds import Fields, floats, integers, scalars
from ftqp.kernel.layout.rows import KEEPS


def keeps_fields(N: int) -> Fields:
    """What ``ftqp.kernel.rows.keep_rows`` needs.

    ``body``: the joint whose frame the point ``place`` moves with; ``normal``'p >= ``offset`` is its side,
    along W; ``brake``: how hard the arm can brake it there [m/s2]; ``distance``: as of the last tick [m].
    """
    return [
        *scalars("i8", "count"),
        *integers({"body": (KEEPS,)}),
        *floats(dict.fromkeys(("offset", "brake", "distance"), (KEEPS,))),
        *floats(dict.fromkeys(("place", "normal"), (KEEPS, 3))),
    ]
