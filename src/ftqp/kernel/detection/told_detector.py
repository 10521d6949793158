"""What a detector is told between its ticks: to begin anew, of joints that have failed, of a load."""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import TOLD_ANEW, TOLD_FAILED, TOLD_LOAD

PAUSE = 150
"""Ticks without verdicts after a joint was believed to have failed: what is left of its fault has passed by
then."""


@jit
def tell(D: Any, joint: int, what: int) -> None:
    """Take in what a detector is told, see ``ToldDetector``; of a joint, where it is about one."""
    if what == TOLD_ANEW:
        _begin_anew(D)
    elif what == TOLD_LOAD:
        D.load[:] = 0.0
        D.load_sum[:] = 0.0
        D.load_square[:] = 0.0
    else:
        _believe(D, joint, 1 if what == TOLD_FAILED else 0)


@jit
def _begin_anew(D: Any) -> None:
    """What was found is forgotten, and sensors are believed again."""
    D.fresh = 1
    D.worst = 0.0
    D.watch = 0
    D.kinds[:] = 0
    D.z[:] = 0.0
    D.tally[:] = 0.0
    D.peak[:] = 0.0


@jit
def _believe(D: Any, i: int, failed: int) -> None:
    """A joint that has failed is not diagnosed again, the others are; one that works is looked at anew."""
    D.believed[i] = D.blind[i] = failed
    D.waiting = D.watch = D.quiet = D.agreed = 0
    D.pause = PAUSE
    if failed == 0:
        D.sensor[i] = D.kinds[i] = D.same[i] = D.missing[i] = D.off[i] = D.turns[i] = 0
        D.fresh = 1
