"""The kernel of a process: the built library, whose functions become functions of Python, or plain Python.

With it what a library is built for: classes of processors, a state of the source, and entry points.
"""

import ast
import ctypes
import hashlib
import importlib
import json
import logging
import os
import platform
import re
import struct
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

_LOG = logging.getLogger("ftqp")

KERNEL = Path(__file__).resolve().parents[1]
"""The folder of the kernel's source."""
BUILT = KERNEL.parent / "_kernel"
"""The folder of the built library."""
BUILDING = os.environ.get("FTQP_BUILD_KERNEL") == "1"
"""Whether the formulas are written for numba in this process; who builds sets it before they are imported."""
PLAIN = (
    os.environ.get("NUMBA_DISABLE_JIT", "0").strip() not in ("", "0") or sys.implementation.name != "cpython"
)
"""Whether the kernel must run as plain Python: asked for by ``NUMBA_DISABLE_JIT=1``, or no CPython."""

LEVELS: Final[dict[str, dict[str, tuple[str, ...]]]] = {
    "x86_64": {
        "x86-64-v4": ("AVX2", "FMA3", "F16C", "AVX512F", "AVX512CD", "AVX512BW", "AVX512DQ", "AVX512VL"),
        "x86-64-v3": ("AVX2", "FMA3", "F16C"),
        "x86-64-v2": ("SSE42", "POPCNT"),
    },
    "aarch64": {"generic": ()},
    "arm64": {"apple-m1": ()},
}
"""For each architecture the classes by LLVM's name, the best first, with what numpy calls their features."""
LEVELS["AMD64"] = LEVELS["x86_64"]


def _features() -> dict[str, Any]:
    """What this processor has, as numpy finds it when it is imported."""
    try:
        from numpy._core._multiarray_umath import (  # type: ignore[import-not-found]
            __cpu_features__ as found,
        )
    except ImportError:
        return {}
    return dict(found)


def level_here() -> str | None:
    """The best class that this machine belongs to; ``None`` where there is none."""
    return next((name for name in LEVELS.get(platform.machine(), {}) if belongs(name)), None)


def belongs(level: str) -> bool:
    """Whether this machine belongs to a class."""
    wanted, found = LEVELS.get(platform.machine(), {}).get(level), _features()
    return wanted is not None and all(found.get(name, False) for name in wanted)


BUILDER = "building"
"""The folder of what builds the kernel, which is no part of its source."""


def file_key(package: Path) -> str:
    """A hash of every source file of a package, in hexadecimal."""
    return _key(package, Path.read_bytes)


def code_key(package: Path) -> str:
    """A hash of a package's code: comments and docstrings do not change it."""
    return _key(package, lambda path: code_text(path).encode())


def code_text(path: Path) -> str:
    """The code of a source file without comments and docstrings; the text as it is where it is no Python."""
    text = path.read_text(encoding="utf-8")
    try:
        tree = ast.parse(text)
    except SyntaxError:
        return text
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [one for one in body if not _is_text(one)]  # type: ignore[attr-defined]
    return ast.unparse(tree)


def _is_text(node: ast.AST) -> bool:
    """Whether a statement is nothing but a text: a docstring, of a function or of a constant."""
    if not isinstance(node, ast.Expr):
        return False
    return isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def _key(package: Path, content_of: Callable[[Path], bytes]) -> str:
    digest = hashlib.sha256()
    for path in sorted((*package.rglob("*.py"), *package.rglob("*.c"))):
        if path.parent.name == BUILDER:
            continue
        content = content_of(path)
        digest.update(f"{path.relative_to(package).as_posix()}\0{len(content)}\0".encode())
        digest.update(content)
    return digest.hexdigest()[:24]


@dataclass(frozen=True, slots=True, kw_only=True)
class EntryPoint:
    """One way into the kernel."""

    name: str  # Unique, a Python identifier
    module: str  # That with its formulas; imported only to compile it or to run it as plain Python
    factory: str  # What may take how many joints a record has room for there, and returns the function
    # A letter an argument: ``i`` an integer (an address, a count), ``o`` a Python object, which compiled code
    # gets as its address and plain Python as itself
    signature: str
    nogil: bool = False  # Whether other Python threads run while it does; it must touch no Python object then
    caller: str = "python"  # Or ``c``: then it is a function of int64_t that returns one
    alone: bool = False  # Whether it knows no robot, so that its loops may be long

    def function(self, *joints: int) -> Callable[..., int]:
        """The Python function with its formulas, for records with room for so many joints; else the most."""
        factory: Callable[..., Callable[..., int]] = getattr(
            importlib.import_module(self.module), self.factory
        )
        return factory(*joints)

    @property
    def symbol(self) -> str:
        """Its name in object files."""
        return f"ftqp_{'' if self.caller == 'python' else 'c_'}{self.name}"


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
    """Entry points in a loaded library, by symbol: the signature, and whether it lets other threads run."""

    def __init__(self, code: Any, entries: dict[str, Any], level: str) -> None:
        self._code = code
        self._entries = entries
        self.level = level

    def function(self, entry: EntryPoint) -> Callable[..., int] | None:
        """An entry point; ``None`` where the library does not have it."""
        symbol = entry.symbol
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

    A library that is damaged is not loaded: its machine code would end the process, or compute other commands
    without a word.
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


def store_lanes(path: Path, content: bytes) -> None:
    """Write a file in one go: there is all of it, or what was there before."""
    handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        with suppress(OSError):
            os.unlink(temporary)
        raise


def describe(out: Path, **said: Any) -> None:
    """Write what is said of the libraries in a folder; with a reason, why there are none."""
    nothing = {"libraries": [], "files": "", "code": "", "reason": ""}
    out.mkdir(parents=True, exist_ok=True)
    text = json.dumps(platform_facts() | nothing | said, indent=1, sort_keys=True)
    store_lanes(out / MANIFEST, f"{text}\n".encode())


class Kernel:
    """Entry points of a source and of what is built of it, each made ready when it is first asked for.

    There is no lock: an exception that comes at the end of a block with a lock may leave it locked for ever.
    What two threads make ready at the same time is made twice, and the first is kept.
    """

    def __init__(self, source: Path, built: Path) -> None:
        self._source = source
        self._built = built
        self._ready: dict[EntryPoint, Callable[..., int]] = {}
        self._found: tuple[Library | None] | None = (None,) if PLAIN else None
        self._warned = False

    def load(self, entry: EntryPoint) -> Callable[..., int]:
        """An entry point: built, or as plain Python, which a warning says once."""
        function = self._ready.get(entry)
        if function is None:
            library = self._sought()
            function = None if library is None else library.function(entry)
            if function is None:
                if library is not None:
                    self._warn(f"the built kernel has no {entry.name}")
                function = entry.function()
            function = self._ready.setdefault(entry, function)
        return function

    def level(self) -> str:
        """The class of processors that the library in use was built for; empty where none is used."""
        library = self._sought()
        return "" if library is None else library.level

    def _sought(self) -> Library | None:
        if self._found is None:
            library = None
            try:
                library = library_in(self._built, self._source)
            except NoLibrary as error:
                self._warn(str(error))
            self._found = (library,)
        return self._found[0]

    def _warn(self, problem: str) -> None:
        """Say once, in one sentence, that plain Python runs."""
        if not self._warned:
            self._warned = True
            _LOG.warning("%s; plain Python does its work, some hundred times slower; %s", problem, REMEDY)


_KERNEL = Kernel(KERNEL, BUILT)


load, level = _KERNEL.load, _KERNEL.level
