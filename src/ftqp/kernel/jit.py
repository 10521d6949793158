"""What the formulas of the kernel are written with: how helpers are compiled, and the memory at an address.

``NUMBA_DISABLE_JIT=1``, or a platform without numba, runs the same source as plain Python. Helpers become
part of the entry points that call them; how those become machine code is up to ``ftqp.kernel.compiled``.
"""

import ctypes
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from ftqp.kernel.compiled.mode import COMPILED

F = TypeVar("F", bound=Callable[..., Any])

if COMPILED:
    from numba import carray, types
    from numba.core import cgutils
    from numba.extending import intrinsic

    from ftqp.kernel.compiled.making.lean import helper

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
        return helper(function, rare=True)

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

    def jit(function: F) -> F:
        """The function as it is."""
        return function

    exact_jit = rare_jit = jit

__all__ = [
    "COMPILED",
    "carray",
    "exact_jit",
    "jit",
    "pointer",
    "rare_jit",
]
