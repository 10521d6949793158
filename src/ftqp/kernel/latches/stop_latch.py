"""A stop that is latched: the arm is brought to rest and stays so until someone resumes."""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import HOLD
from ftqp.kernel.layout.thresholds import AT_REST, GOES_ON, STANDS


@jit
def latch(watch: Any, reason: int) -> None:
    """Latch a stop; whoever does asks before whether one is latched, whose reason stays."""
    watch.latched = 1
    watch.reason = reason


@jit
def slow_enough(K: Any) -> float:
    """Below this share of its limit a joint counts as at rest in a stop.

    An arm that balances the free joint always moves a little, so that what is seen of joints counts there:
    5 % while it is said to have stopped, 2 % until then.
    """
    if K.faults.movable == K.faults.working or K.free.mode != HOLD:
        return AT_REST
    return GOES_ON if K.watch.stopped else STANDS
