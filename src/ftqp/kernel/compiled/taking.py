"""A caller's numbers, copied by compiled code through Python's buffer protocol: no address is remembered."""

from typing import Any

import numpy as np

from ftqp.kernel.jit import COMPILED, carray, jit, pointer

NO_BUFFER = -1
VIEW = 10
"""Size of CPython's Py_buffer, in words of 8 bytes."""
CONTIGUOUS = 0x3C
"""PyBUF_C_CONTIGUOUS | PyBUF_FORMAT."""
DOUBLE = ord("d")
FLOAT = np.dtype(np.float64)
BYTE = np.dtype(np.uint8)

if COMPILED:
    from numba.core import types

    _get = types.ExternalFunction("PyObject_GetBuffer", types.int32(types.int64, types.intp, types.int32))
    _release = types.ExternalFunction("PyBuffer_Release", types.void(types.intp))
    _clear = types.ExternalFunction("PyErr_Clear", types.void())

    @jit
    def take(source: int, first: int, to: Any, dimensions: int, view: Any) -> int:
        """Copy numbers of a buffer of contiguous float64 into ``to``: how many there are from ``first`` on.

        Args:
            source: address of the Python object, which the caller keeps alive.
            first: index of the first number, in the order of memory.
            to: where they go; no more than it holds are copied.
            dimensions: how many the buffer must have, 0 for any number.
            view: scratch memory, (10,) whole numbers.
        """
        at = view.ctypes.data
        if _get(source, at, CONTIGUOUS) != 0:
            _clear()
            return NO_BUFFER
        count = NO_BUFFER
        if view[3] == 8 and view[5] != 0 and (dimensions == 0 or view[4] >> 32 == dimensions):
            code = carray(pointer(view[5]), (2,), BYTE)
            if code[0] == DOUBLE and code[1] == 0:
                size = view[2] // 8
                count = max(size - first, 0)
                given = carray(pointer(view[0]), (size,), FLOAT)
                for k in range(min(count, len(to))):
                    to[k] = given[first + k]
        _release(at)
        return count

else:

    def take(source: Any, first: int, to: Any, dimensions: int, view: Any) -> int:
        """The same on the Python object itself."""
        try:
            given = memoryview(source)
        except TypeError:
            return NO_BUFFER
        if given.format != "d" or not given.c_contiguous or dimensions not in (0, given.ndim):
            return NO_BUFFER
        numbers = np.frombuffer(given, dtype=FLOAT)
        count = max(len(numbers) - first, 0)
        copied = min(count, len(to))
        to[:copied] = numbers[first : first + copied]
        return count
