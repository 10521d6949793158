"""Arrays that are no records: the table of a path, a network's memory."""

from typing import Final

BEGIN = 0
"""Column of a table: path time at which the interval begins [s]."""
STOP = 1
"""Column: path time of the next jump of the twist, inf if there is none."""
POSITION = 2
"""Columns: six coefficients of the position, (6, 3), by rising powers of the time since BEGIN."""
ORIENTATION = 20
"""Columns: rotation at BEGIN, by rows."""
TURN = 29
"""Columns: three coefficients of the rotation vector, powers 1 to 3, (3, 3)."""
SPIN = 38
"""Columns: four coefficients of the angular velocity, (4, 3)."""
COLUMNS = 50
"""The table of a path has a row an interval of its time. In each the position is a quintic, the rotation a
cubic rotation vector from the interval's first orientation, the angular velocity a cubic."""

OPTIONS: Final = 7
"""Numbers that say how to solve, see ``ftqp.kernel.dtrnn.network.Options``."""
VECTORS: Final = 15
"""Vectors of the network's size."""
VALID: Final = OPTIONS
"""Offset in a planner's memory: whether a warm start is kept."""
SIZES: Final = OPTIONS + 1
"""Offset: the three sizes that it is for."""
KEPT: Final = OPTIONS + 4
"""Offset: the warm start, then the network."""


def memory_size(n: int, m: int, p: int) -> int:
    """Numbers that the network of a QP of n variables, m equality and p two-sided rows takes at most."""
    most = n + p + m + p
    return 3 * most * most + VECTORS * most + 2 + m


def planner_memory_size(n: int, m: int, p: int) -> int:
    """Numbers that a planner of n variables, m task rows and p two-sided rows needs for the network."""
    return KEPT + 2 * (n + p) + m + memory_size(n, m, p)
