"""What the kernel asks of the process around it: a call of a Python function, and the time."""

from typing import Any

from ftqp.core import clock
from ftqp.kernel.compiled.facts import CALL_FAILED
from ftqp.kernel.compiled.mode import BUILDING

if BUILDING:
    from ftqp.kernel.compiled.making.process_calls import nanoseconds, tick_of

else:

    def tick_of(function: Any, q: Any, v: Any, targets: Any, row: int) -> int:
        """The status that a Python function gives for (q, v, targets, row); CALL_FAILED when it raises."""
        try:
            return int(function(q, v, targets, row))
        except Exception:  # as in compiled code: the caller repeats the call to see the error
            return CALL_FAILED

    def nanoseconds() -> int:
        """A clock that only goes forward [ns]."""
        return clock.now()


__all__ = ["CALL_FAILED", "nanoseconds", "tick_of"]
