"""The library of compiled code that a wheel carries: loaded where it fits, without numba or llvmlite."""

import ctypes
import hashlib
import json
import os
import platform
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ftqp.kernel.compiled import folder as folders
from ftqp.kernel.compiled.entry_point import EntryPoint
from ftqp.kernel.compiled.facts import TABLE, fill
from ftqp.kernel.compiled.machine_code import function_at

SWITCH = "FTQP_NO_WHEEL_KERNEL"
"""The environment variable that, set to anything but 0, leaves the library of a wheel unused."""

FORMAT = 2
MANIFEST = "manifest.json"
LIBRARY = "kernel.so"
FITS = "ftqp_fits"
"""A function of the library: 1 where this machine's processor has everything that its code uses."""


def platform_facts() -> dict[str, Any]:
    """What a library must have been made for to be used here, its source and processor apart."""
    return {
        "format": FORMAT,
        "system": platform.system(),
        "machine": platform.machine(),
        "implementation": sys.implementation.name,
        "pointer": ctypes.sizeof(ctypes.c_void_p),
    }


class Library:
    """Entry points in a library of compiled code.

    Args:
        code: the loaded library.
        entries: the signature of each symbol, and whether it releases the interpreter.
    """

    def __init__(self, code: Any, entries: dict[str, Any]) -> None:
        self._code = code
        self._entries = entries

    def function(self, entry: EntryPoint, capacity: int) -> Callable[..., int] | None:
        """An entry point for records of that capacity; ``None`` where the library does not have it."""
        symbol = entry.symbol(capacity)
        if self._entries.get(symbol) != [entry.signature, entry.nogil]:
            return None
        try:
            address = ctypes.cast(getattr(self._code, symbol), ctypes.c_void_p).value
            table = ctypes.addressof(ctypes.c_int64.in_dll(self._code, symbol + TABLE))
        except (AttributeError, ValueError):
            return None
        if address is None:
            return None
        fill(table)
        return function_at(address, symbol, self._code)


def fingerprint(library: bytes) -> str:
    """What the manifest says of its library, in hexadecimal: a library of another one is not loaded."""
    return hashlib.sha256(library).hexdigest()


def library_of(folder: Path, source: str) -> Library | None:
    """The library in a folder, if it fits the platform, the processor and the source; else ``None``.

    A library that is damaged, or that another user could have changed, is not loaded, and a warning says so.

    Args:
        folder: with ``manifest.json`` and ``kernel.so``; it need not exist.
        source: the key of the Python source that the kernel is compiled from.
    """
    if os.environ.get(SWITCH, "0") not in ("", "0"):
        return None
    try:
        text = (folder / MANIFEST).read_bytes()
    except OSError:
        return None
    try:
        manifest = json.loads(text)
    except (ValueError, RecursionError):
        manifest = None
    if not isinstance(manifest, dict) or not isinstance(manifest.get("entries"), dict):
        folders.refused(folder / MANIFEST, "is damaged")
        return None
    wanted = {**platform_facts(), "source": source}
    if {name: manifest.get(name) for name in wanted} != wanted:
        return None
    try:
        if not _is_trusted(folder, manifest.get("sha256")):
            return None
        code = ctypes.CDLL(str(folder / LIBRARY))
        fits = code[FITS]
    except (OSError, AttributeError):
        return None
    return Library(code, manifest["entries"]) if fits() == 1 else None


def _is_trusted(folder: Path, expected: Any) -> bool:
    """Whether the library is that of its manifest, and nobody else could put another one there.

    Machine code that is damaged ends the process, or computes other commands without a word.
    """
    for place in (folder, folder / MANIFEST, folder / LIBRARY):
        problem = folders.installed_problem(place)
        if problem:
            folders.refused(place, problem)
            return False
    if fingerprint((folder / LIBRARY).read_bytes()) == expected:
        return True
    folders.refused(folder / LIBRARY, f"is not what {MANIFEST} says it is (its sha256 differs)")
    return False
