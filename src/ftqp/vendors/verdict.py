"""What a status word means: for a joint, for the whole arm, and what ends it."""

from dataclasses import dataclass
from typing import Final

from ftqp.faults.kinds import Fault

GOES_ON: Final = "goes_on"
PAUSED: Final = "paused"
OFF: Final = "off"
ARM: Final = (GOES_ON, PAUSED, OFF)
"""What the whole arm does, from the best to the worst."""
PERSON: Final = "person"
PROGRAM: Final = "program"


@dataclass(frozen=True, slots=True)
class RecoveryStep:
    """One step back to work.

    Args:
        by: Who takes it: ``person`` or ``program``.
        do: What is done.
        after: Not sooner than so long after the last step [s].
    """

    by: str
    do: str
    after: float = 0.0


@dataclass(frozen=True, slots=True)
class Verdict:
    """What a status word means.

    Args:
        joint: The joint's name; None is the arm as a whole.
        fault: What is reported to a planner, or None. A joint that is off and has no known brake is
            ``ftqp.FreeSwinging``; a ``Watch`` looks at what it does.
        arm: What the whole arm does: ``goes_on``, ``paused`` or ``off``.
        why: One sentence, with the word and its number.
        recovery: The steps back to work, in order.
        sensor_lost: The joint's samples mean nothing: they are to be fed as NaN.
    """

    joint: str | None
    fault: Fault | None
    arm: str
    why: str
    recovery: tuple[RecoveryStep, ...] = ()
    sensor_lost: bool = False
