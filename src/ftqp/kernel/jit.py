"""What the formulas of the kernel are written with: how helpers are compiled, and what they ask of Python.

Where the package is built, numba makes machine code of them; how is up to ``ftqp.kernel.compiled.making``. In
every other process they are plain Python, which runs where the built library has no such entry point. Numbers
of a Python object are copied at once, so that nothing is kept of it; compiled code has that of ``glue.c``.
"""

import ctypes
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from ftqp.kernel.compiled.library import BUILDING as COMPILED

F = TypeVar("F", bound=Callable[..., Any])

BAD_BUFFER = -1
"""The object is no readable C-contiguous buffer of float64 in this machine's byte order."""

if COMPILED:
    from numba import carray, types
    from numba.core import cgutils
    from numba.extending import intrinsic
    from numba.types import ExternalFunction, int64

    from ftqp.kernel.compiled.making.helper import helper

    take = ExternalFunction("ftqp_take", int64(int64, int64, int64, int64, int64))

    @intrinsic  # type: ignore[untyped-decorator]
    def pointer(context: Any, address: Any) -> Any:
        """The address as a pointer, for ``carray``."""
        return types.voidptr(address), lambda _c, builder, _s, args: builder.inttoptr(
            args[0], cgutils.voidptr_t
        )

    def jit(function: F) -> F:
        """Compile a helper of the kernel; it becomes part of the entry points that call it."""
        return helper(function)

    def rare_jit(function: F) -> F:
        """Compile a helper that most ticks do without: its code lies apart, so that theirs lies together."""
        return helper(function, apart=True, rare=True)

    def part_jit(function: F) -> F:
        """Compile a large helper once for all entry points that call it."""
        return helper(function, apart=True)

    def long_jit(function: F) -> F:
        """The same, with loops in which arms of many joints spend their time."""
        return helper(function, apart=True, long=True)

    def exact_jit(function: F) -> F:
        """Compile a helper whose rounding must stay as written: no fast math."""
        return helper(function, fast=False)

else:

    def carray(address: int, shape: Any, dtype: Any) -> Any:
        """The array of that shape and type at an address."""
        count = int(np.prod(shape))
        buffer = (ctypes.c_char * (count * dtype.itemsize)).from_address(int(address))
        array = np.frombuffer(buffer, dtype=dtype).reshape(shape)
        return array.view(np.recarray) if dtype.names else array

    def pointer(address: int) -> int:
        """The address itself; plain Python's ``carray`` takes it as it is."""
        return address

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

    def jit(function: F) -> F:
        """The function as it is."""
        return function

    exact_jit = long_jit = part_jit = rare_jit = jit

__all__ = [
    "BAD_BUFFER", "COMPILED", "carray", "exact_jit", "jit", "long_jit", "part_jit", "pointer", "rare_jit",
    "take",
]  # fmt: skip
