"""A joint without motor and brake, when it is told: who leads then, and how long it is looked at."""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import FREE, MAKE_UP, MEASURED

WINDOW = 0.05
"""Motion that is looked at as a whole [s]. A convention: a joint that falls has gone 12 mrad by then."""
LEAST_SAMPLES = 8
"""Samples of a window at least, because a line through fewer leaves hardly anything of their noise."""


@jit
def window_ticks(dt: float) -> int:
    """Ticks of a window."""
    return max(LEAST_SAMPLES, int(WINDOW / dt + 0.5))


@jit
def who_leads(faults: Any, chain: Any, free: Any) -> None:
    """The search begins anew where a joint swings; where joints are only measured, the task leads."""
    measured = -1
    for i in range(chain.n):
        if faults.code[i] == FREE:
            free.joint = -1
            return
        if faults.code[i] == MEASURED and measured < 0:
            measured = i
    if measured >= 0:
        free.joint, free.mode, free.impact_side = measured, MAKE_UP, 0
