"""What the formulas of the kernel are written with: how helpers are compiled, and the memory at an address.

Where the package is built, numba makes machine code of them; how is up to ``ftqp.kernel.compiled.making``. In
every other process they are plain Python, which runs where the built library has no such entry point.
"""

import ctypes
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from ftqp.kernel.compiled.mode import BUILDING as COMPILED

F = TypeVar("F", bound=Callable[..., Any])

if COMPILED:
    from numba import carray, types
    from numba.core import cgutils
    from numba.extending import intrinsic

    from ftqp.kernel.compiled.making.helper import helper

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

    def jit(function: F) -> F:
        """The function as it is."""
        return function

    exact_jit = long_jit = part_jit = rare_jit = jit

__all__ = [
    "COMPILED",
    "carray",
    "exact_jit",
    "jit",
    "long_jit",
    "part_jit",
    "pointer",
    "rare_jit",
]
