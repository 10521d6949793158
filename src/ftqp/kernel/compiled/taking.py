"""Numbers taken from a Python object by the kernel: copied at once, so nothing is kept of the object."""

import ctypes
from typing import Any

from ftqp.kernel.compiled.mode import BUILDING

BAD_BUFFER = -1
"""The object is no readable C-contiguous buffer of float64 in this machine's byte order."""

if BUILDING:
    from numba.types import ExternalFunction, int64

    take = ExternalFunction("ftqp_take", int64(int64, int64, int64, int64, int64))

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


__all__ = ["BAD_BUFFER", "take"]
