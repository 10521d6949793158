"""What the kernel asks of the process around it: a call of a Python function, and the time."""

from typing import Any

from ftqp.core import clock
from ftqp.kernel.compiled.mode import BUILDING

CALL_FAILED = -1_000
"""The Python function raised or gave no whole number; the error is forgotten."""

if BUILDING:
    from numba.types import ExternalFunction, int64

    tick_of = ExternalFunction("ftqp_tick_of", int64(int64, int64, int64, int64, int64))
    nanoseconds = ExternalFunction("ftqp_nanoseconds", int64())

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
