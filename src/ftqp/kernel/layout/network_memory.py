"""How much memory the network takes: plain functions, for compiled code and for whoever allocates it."""

from typing import Final

OPTIONS: Final = 7
"""Numbers that say how to solve, see ``ftqp.kernel.dtrnn.stopping.Options``."""
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
    return 3 * most * most + VECTORS * most + 2


def planner_memory_size(n: int, m: int, p: int) -> int:
    """Numbers that a planner of n variables, m task rows and p two-sided rows needs for the network."""
    return KEPT + 2 * (n + p) + m + memory_size(n, m, p)


def standalone_memory_size(n: int, m: int, p: int) -> int:
    """Numbers that the network needs for a QP that is not a planner's."""
    return memory_size(n, m, p) + m
