"""The table of a path: one row an interval of its time, its columns by name.

In each interval the position is a quintic, the rotation a cubic rotation vector from the interval's first
orientation, the angular velocity a cubic.
"""

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
