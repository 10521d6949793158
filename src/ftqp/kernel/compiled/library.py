"""The library of the built kernel: looked at, loaded, and its functions made functions of Python."""

import ctypes
import hashlib
import json
import os
import platform
import re
import stat
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.kernel.compiled.entry_point import EntryPoint
from ftqp.kernel.compiled.levels import belongs
from ftqp.kernel.compiled.source_text import code_key, file_key

FORMAT = 4
MANIFEST = "manifest.json"
_NAME = re.compile(r"kernel-[0-9a-f]{12}\.so")
METH_FASTCALL = 0x80
MOST = 64
"""Arguments of an entry point at most, as in ``glue.c``."""
REMEDY = "`make kernel` in the source, or installing ftqp anew, builds it"


class NoLibrary(Exception):
    """There is no library that can be used; the message says why."""


class _MethodDefinition(ctypes.Structure):
    """``PyMethodDef``."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("function", ctypes.c_void_p),
        ("flags", ctypes.c_int),
        ("doc", ctypes.c_char_p),
    )


class Library:
    """Entry points in a loaded library.

    Args:
        code: the library.
        entries: the signature of each symbol, and whether it releases the interpreter.
        level: the class of processors that it was built for.
    """

    def __init__(self, code: Any, entries: dict[str, Any], level: str) -> None:
        self._code = code
        self._entries = entries
        self.level = level

    def function(self, entry: EntryPoint, capacity: int) -> Callable[..., int] | None:
        """An entry point for records of that capacity; ``None`` where the library does not have it."""
        symbol = entry.symbol(capacity)
        if self._entries.get(symbol) != [entry.signature, entry.nogil]:
            return None
        at = ctypes.cast(getattr(self._code, symbol), ctypes.c_void_p).value
        letters = entry.signature.encode()
        what = struct.pack(f"=qqq{MOST}s", at, entry.nogil, len(letters), letters) + symbol.encode() + b"\0"
        call = ctypes.cast(self._code.ftqp_call, ctypes.c_void_p).value
        definition = _MethodDefinition(symbol.encode(), call, METH_FASTCALL, None)
        new = ctypes.pythonapi["PyCFunction_NewEx"]
        new.restype, new.argtypes = ctypes.py_object, (ctypes.c_void_p, ctypes.py_object, ctypes.c_void_p)
        function: Callable[..., int] = new(ctypes.addressof(definition), what, None)
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(definition))
        return function


def platform_facts() -> dict[str, Any]:
    """What a library must have been built for to be used here, its source and processor apart."""
    return {
        "format": FORMAT,
        "system": platform.system(),
        "machine": platform.machine(),
        "implementation": sys.implementation.name,
        "pointer": ctypes.sizeof(ctypes.c_void_p),
    }


def fingerprint(library: bytes) -> str:
    """What the manifest says of its library, in hexadecimal: a library of another one is not loaded."""
    return hashlib.sha256(library).hexdigest()


def library_in(folder: Path, source: Path) -> Library:
    """The library in a folder, if it fits platform, processor and source.

    A library that is damaged, or that another user could have changed, is not loaded: machine code that is
    damaged ends the process, or computes other commands without a word.
    """
    manifest = _manifest(folder)
    built_for = {name: manifest.get(name) for name in platform_facts()}
    if built_for != platform_facts():
        raise NoLibrary(f"the kernel in {folder} was built for {built_for}, and this is {platform_facts()}")
    fitting = [one for one in manifest["libraries"] if belongs(one["level"])]
    if not fitting:
        levels = ", ".join(one["level"] for one in manifest["libraries"])
        raise NoLibrary(
            f"this processor does not have all that the kernel in {folder} was built for ({levels})"
        )
    if manifest["files"] not in ("", file_key(source)) and manifest["code"] != code_key(source):
        raise NoLibrary(f"the kernel in {folder} is older than its source in {source}")
    chosen = fitting[0]
    path = folder / chosen["file"]
    for place in (folder, folder / MANIFEST, path):
        problem = problem_of(place)
        if problem:
            raise NoLibrary(f"{place} {problem}, so its machine code is not loaded")
    try:
        found = fingerprint(path.read_bytes())
    except OSError as error:
        raise NoLibrary(f"{path} cannot be read ({error.strerror})") from None
    if found != chosen["sha256"]:
        raise NoLibrary(f"{path} is not what {MANIFEST} says (its sha256 differs), so it is not loaded")
    return _loaded(path, chosen)


def _manifest(folder: Path) -> dict[str, Any]:
    """What the manifest says; of what is damaged in it, NoLibrary says so."""
    try:
        text = (folder / MANIFEST).read_bytes()
    except OSError:
        raise NoLibrary("the kernel is not built") from None
    try:
        manifest: dict[str, Any] = json.loads(text)
        for one in manifest["libraries"]:
            if {*one} != {"file", "level", "sha256", "entries"} or not _NAME.fullmatch(one["file"]):
                raise ValueError
            if not isinstance(one["level"], str) or not isinstance(one["entries"], dict):
                raise TypeError
        reason, _, _ = manifest["reason"], manifest["files"], manifest["code"]
    except (ValueError, RecursionError, TypeError, KeyError, AttributeError):
        raise NoLibrary(f"{folder / MANIFEST} is damaged, so its machine code is not loaded") from None
    if not manifest["libraries"]:
        raise NoLibrary(f"the kernel could not be built ({reason})")
    return manifest


def _loaded(path: Path, described: dict[str, Any]) -> Library:
    try:
        for name in {"linux": ("libm.so.6", "libm.so"), "win32": ("ucrtbase",)}.get(sys.platform, ()):
            try:  # the code calls its functions, and Python itself need not have loaded them for all to see
                ctypes.CDLL(name, mode=ctypes.RTLD_GLOBAL)
                break
            except OSError:
                continue
        code, probe = ctypes.CDLL(str(path)), np.zeros((2, 3))
        kinds = (ctypes.c_void_p(id(one)) for one in (np.ndarray, probe.dtype, probe))
        code.ftqp_begin(*kinds, ctypes.c_int64(probe.ctypes.data))
        for symbol in described["entries"]:
            code[symbol]
    except (OSError, AttributeError, ValueError) as error:
        raise NoLibrary(f"{path} cannot be loaded ({error})") from None
    return Library(code, described["entries"], described["level"])


def problem_of(place: Path) -> str:
    """Why somebody else could have changed a file or folder of the installation; empty where nobody could.

    It must belong to us, to root, or to whoever installed this very Python file, and no other user may write.
    """
    try:
        what = os.stat(place)
    except OSError:
        return "is missing"
    if not hasattr(os, "getuid"):
        return ""
    if what.st_uid not in (os.getuid(), 0, os.stat(__file__).st_uid):
        return "belongs to another user"
    return "can be written by other users" if _others_write(what) else ""


def _others_write(what: os.stat_result) -> bool:
    if what.st_mode & stat.S_IWOTH:
        return True
    return bool(what.st_mode & stat.S_IWGRP) and not _is_group_of_ours_alone(what.st_gid)


def _is_group_of_ours_alone(group: int) -> bool:
    """Whether it is the group that many systems give each user: of the same name, with nobody else in it."""
    import grp
    import pwd

    try:
        user, found = pwd.getpwuid(os.getuid()), grp.getgrgid(group)
    except KeyError:
        return False
    return group == user.pw_gid and found.gr_name == user.pw_name and set(found.gr_mem) <= {user.pw_name}
