"""How a motion after a failure that nobody was told of ends."""

from enum import IntEnum


class Ending(IntEnum):
    """What becomes of the tip: at the goal, at rest elsewhere, no rest, at a singularity, or not known."""

    CORRECT = 0
    ERRONEOUS = 1
    NONE = 2
    SINGULAR = 3
    UNRESOLVED = 4


CORRECT, ERRONEOUS, NONE, SINGULAR, UNRESOLVED = map(int, Ending)
