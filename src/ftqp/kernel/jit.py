"""How the kernel is compiled: decorators, the record behind an address, the disk cache.

``NUMBA_DISABLE_JIT=1``, or a platform without numba, runs the same source as plain Python.

numba's disk cache notices a change only in the file of the cached function. Only the entry points are cached,
and
their cache folder is named after a hash of every source file of the kernel, so a change in any of them
compiles anew.
"""

import ctypes
import hashlib
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ftqp.kernel.compiled.mode import COMPILED

F = TypeVar("F", bound=Callable[..., Any])


def source_key(package: Path) -> str:
    """A hash of every source file of the kernel package, in hexadecimal."""
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        digest.update(str(path.relative_to(package)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_home() -> Path:
    """The folder below which compiled kernels are kept: ``NUMBA_CACHE_DIR``, or the user's cache folder."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given:
        return Path(given)
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", str(Path.home())))
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "ftqp"


def _writable(folder: Path) -> Path:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        return (
            Path(tempfile.gettempdir())
            / f"ftqp-{os.getuid() if hasattr(os, 'getuid') else 'cache'}"
            / folder.name
        )


def cache_folder() -> Path:
    """The folder of the compiled kernel that belongs to exactly this source."""
    return cache_home() / f"kernel-{source_key(Path(__file__).parent)}"


def _plain_carray(address: int, shape: Any, dtype: Any) -> Any:
    count = int(np.prod(shape))
    buffer = (ctypes.c_char * (count * dtype.itemsize)).from_address(int(address))
    array = np.frombuffer(buffer, dtype=dtype)
    return array.view(np.recarray) if dtype.names else array


if COMPILED:
    import numba
    from numba import carray, njit, prange, types
    from numba.core import cgutils
    from numba.extending import intrinsic

    from ftqp.kernel.compiled.lean import FAST, helper

    @intrinsic  # type: ignore[untyped-decorator]
    def pointer(context: Any, address: Any) -> Any:
        """The address as a pointer, for ``carray``."""
        return types.voidptr(address), lambda _c, builder, _s, args: builder.inttoptr(
            args[0], cgutils.voidptr_t
        )

    def jit(function: F) -> F:
        """Compile a helper of the kernel; it becomes part of the entry points that call it."""
        return helper(function)

    def exact_jit(function: F) -> F:
        """Compile a helper whose rounding must stay as written: no fast math."""
        return helper(function, fast=False)

    def _cached(function: F, **options: Any) -> F:
        before = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = str(_writable(cache_folder()))
        try:
            compiled: F = njit(cache=True, error_model="numpy", fastmath=FAST, **options)(function)
        finally:
            numba.config.CACHE_DIR = before
        return compiled

    def entry(function: F) -> F:
        """Compile an entry point, kept on disk; it holds the GIL (releasing it can cost a loop 5 ms)."""
        return _cached(function)

    def threads() -> int:
        """How many threads a batch runs on."""
        return int(numba.get_num_threads())

    def batch_entry(function: F) -> F:
        """Compile an entry point that runs many records in parallel without the GIL, and keep it on disk."""
        return _cached(function, nogil=True, parallel=True)

else:
    carray = _plain_carray
    prange = range

    def pointer(address: int) -> int:
        """The address itself; plain Python's ``carray`` takes it as it is."""
        return address

    def threads() -> int:
        """Plain Python runs on one thread."""
        return 1

    def jit(function: F) -> F:
        """The function as it is."""
        return function

    exact_jit = jit
    entry = jit
    batch_entry = jit

__all__ = [
    "COMPILED",
    "batch_entry",
    "cache_folder",
    "carray",
    "entry",
    "exact_jit",
    "jit",
    "pointer",
    "prange",
    "source_key",
    "threads",
]
