"""The row of numbers that a block of ticks keeps of each: its fields, in the order of their places.

A whole row may hold more; whoever gives the memory says where each of these fields begins.
"""

from typing import Final

BLOCK_FIELDS: Final = (
    "q",
    "v",
    "a",
    "tau",
    "tau_brake",
    "lower",
    "upper",
    "tip",
    "slack",
    "jacobian",
    "scalars",
)
"""Fields by name: n numbers each up to ``upper``; ``tip`` 12, the first three rows of the pose; ``slack`` 6;
``jacobian`` 6 n, the task's rows in characteristic lengths, zero for joints that do not work; ``scalars``."""
BLOCK_SCALARS: Final = (
    "position_error",
    "rotation_error",
    "scale",
    "status",
    "qp_status",
    "qp_iterations",
    "qp_residual",
    "step_time",
    "kappa",
)
"""Single numbers, in their order; ``step_time`` in ns."""
PLACES: Final = len(BLOCK_FIELDS)
