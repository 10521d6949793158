"""What the kernel asks of the process around it: numbers of a Python object, a call of a function, the time.

Numbers are copied at once, so that nothing is kept of an object; compiled code has it all of ``glue.c``.
"""

import ctypes
from typing import Any

from ftqp.core import clock
from ftqp.kernel.compiled.mode import BUILDING

BAD_BUFFER = -1
"""The object is no readable C-contiguous buffer of float64 in this machine's byte order."""
CALL_FAILED = -1_000
"""The Python function raised or gave no whole number; the error is forgotten."""

if BUILDING:
    from numba.types import ExternalFunction, int64

    take = ExternalFunction("ftqp_take", int64(int64, int64, int64, int64, int64))
    tick_of = ExternalFunction("ftqp_tick_of", int64(int64, int64, int64, int64, int64))
    nanoseconds = ExternalFunction("ftqp_nanoseconds", int64())

else:

    def take(source: Any, first: int, into: int, count: int, dimensions: int) -> int:
        """Copy numbers out of a Python object: how many it has from ``first`` on, or ``BAD_BUFFER``."""
        try:
            view = memoryview(source)
        except (TypeError, ValueError, BufferError):
            return BAD_BUFFER
        with view:
            if view.ndim == 0 or not view.c_contiguous or view.format.lstrip("@=<") != "d":
                return BAD_BUFFER
            shape = view.shape or ()
            if dimensions not in (0, len(shape)) or (dimensions == 2 and shape[0] != shape[1]):
                return BAD_BUFFER
            found = max(view.nbytes // 8 - first, 0)
            ctypes.memmove(into, view.tobytes()[8 * first :], 8 * min(found, count))
            return found

    def tick_of(function: Any, q: Any, v: Any, targets: Any, row: int) -> int:
        """The status that a Python function gives for (q, v, targets, row); CALL_FAILED when it raises."""
        try:
            return int(function(q, v, targets, row))
        except Exception:  # as in compiled code: the caller repeats the call to see the error
            return CALL_FAILED

    def nanoseconds() -> int:
        """A clock that only goes forward [ns]."""
        return clock.now()


__all__ = ["BAD_BUFFER", "CALL_FAILED", "nanoseconds", "take", "tick_of"]
