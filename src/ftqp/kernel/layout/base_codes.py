"""Codes of a base that moves: attitude, how its task goes, and what of it is measured."""

from enum import IntEnum
from typing import Final


class Attitude(IntEnum):
    """Which attitude of a moving base turns the inertial error into the base's axes."""

    ESTIMATED = 0
    NOMINAL = 1
    MEASURED = 2


ESTIMATED_ATTITUDE, NOMINAL_ATTITUDE, MEASURED_ATTITUDE = map(int, Attitude)


class BaseCode(IntEnum):
    """How a task in inertial space goes; the sentences are those of ``ftqp.BaseStatus``."""

    TRACKING = 0
    SATURATED = 1
    RANK_DEFICIENT = 2
    UNREACHABLE = 3
    STALE = 4
    HALTED = 5


(
    BASE_TRACKING,
    BASE_SATURATED,
    BASE_RANK_DEFICIENT,
    BASE_UNREACHABLE,
    BASE_STALE,
    BASE_HALTED,
) = map(int, BaseCode)

HAS_TIP: Final = 1
"""What is measured at a tick of a moving base, bit by bit."""
HAS_POSITION: Final = 2
"""Of the tip the position only."""
HAS_BASE: Final = 4
"""The pose of the base."""
HAS_TWIST: Final = 8
"""The twist of the base."""
