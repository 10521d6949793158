"""Builds the library of the kernel: units compiled in parallel, kept by what they depend on, and linked.

Objects are kept in a folder by a hash of what their code is made from: bytecode of a function and of all
that it reaches, without comments, docstrings and helpers that lie apart, so that an edit compiles what it
concerns. The library and its manifest are put in their places at the end, whole, by renaming: whoever
interrupts a build, or builds at the same time, leaves the one before or the one behind.
"""

import contextlib
import enum
import hashlib
import importlib
import importlib.util
import multiprocessing
import os
import pickle
import platform
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from shutil import which
from types import CodeType, FunctionType, ModuleType
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core.errors import NumbaError

from ftqp.kernel.building.numba_patches import patch_numba
from ftqp.kernel.building.wheel_targets import BuildTarget, CannotBuild
from ftqp.kernel.compiled.library import (
    KERNEL,
    EntryPoint,
    code_key,
    code_text,
    describe,
    file_key,
    fingerprint,
    store_lanes,
)
from ftqp.kernel.compiled.making import emit
from ftqp.kernel.compiled.making.emit import Target
from ftqp.kernel.compiled.making.helper import Helper, Part
from ftqp.kernel.layout.enums import JOINTS

GLUE = Path(emit.__file__).parents[1] / "glue.c"
"""Compiled beside the units whenever they are linked."""
NO_LINKER = "neither ziglang nor cc is here to link it"
NO_ZIG = "ziglang, which links a library for another machine, is not here"


_MAKING = "compiled/making"
_MAKERS = (
    f"{_MAKING}/emit.py",
    f"{_MAKING}/helper.py",
    f"{_MAKING}/joint_lanes.py",
    f"{_MAKING}/lane_numbers.py",
    "jit.py",
)
"""The files that say how a function becomes machine code."""
_NAMES = ("__module__", "__qualname__")


def key_of(function: Any, *beside: Any) -> str:
    """A hash of a function and of everything that its code is made from, in hexadecimal."""
    text = "\n".join([_maker(), *map(str, beside), *_function(getattr(function, "py_func", function), set())])
    return hashlib.sha256(text.encode()).hexdigest()[:24]


@cache
def _maker() -> str:
    """Whatever makes machine code of functions, here and in other packages."""
    texts = [code_text(KERNEL / name) for name in _MAKERS]
    return f"{sys.version_info[:2]} {numba.__version__} {llvmlite.__version__} {texts}"


def _function(function: FunctionType, seen: set[int]) -> Iterator[str]:
    if id(function) in seen:
        yield f"again {function.__qualname__}"
        return
    seen.add(id(function))
    yield f"function {function.__module__} {function.__qualname__} {function.__defaults__}"
    names: list[str] = []
    yield from _code(function.__code__, function.__doc__, names)
    for cell in function.__closure__ or ():
        yield from _thing(cell.cell_contents, seen)
    for name in dict.fromkeys(names):
        if name in function.__globals__:
            yield f"global {name}"
            yield from _thing(function.__globals__[name], seen)


def _code(code: CodeType, doc: str | None, names: list[str]) -> Iterator[str]:
    """Bytecode without docstring and places in the file; the names that it uses are added to a list."""
    names.extend(code.co_names)
    yield f"{code.co_code.hex()} {code.co_names} {code.co_varnames} {code.co_freevars} {code.co_cellvars}"
    for number, constant in enumerate(code.co_consts):
        if isinstance(constant, CodeType):
            inner = constant.co_consts[0] if constant.co_consts else None
            yield from _code(constant, inner if isinstance(inner, str) else None, names)
        elif number or doc is None or constant != doc:
            yield repr(sorted(map(repr, constant)) if isinstance(constant, frozenset) else constant)


def _thing(thing: Any, seen: set[int]) -> Iterator[str]:
    """What a name in a function, or a cell of its closure, stands for."""
    if isinstance(thing, Helper):
        function = thing.py_func
        yield f"helper {thing.apart} {bool(thing.targetoptions.get('fastmath'))}"
        if thing.apart:
            yield f"{function.__module__} {function.__qualname__} {function.__annotations__.get('return')}"
        else:
            yield from _function(function, seen)
    elif isinstance(thing, FunctionType):
        if thing.__module__.startswith("ftqp."):
            yield from _function(thing, seen)
        else:
            yield f"{thing.__module__}.{thing.__qualname__}"
    elif isinstance(thing, np.ndarray):
        yield f"array {thing.dtype} {thing.shape} {thing.tobytes().hex()}"
    elif isinstance(thing, bool | int | float | str | bytes | None | enum.Enum | np.dtype | np.generic):
        yield repr(thing)
    elif isinstance(thing, tuple | list):
        yield f"{type(thing).__name__} of {len(thing)}"
        for part in thing:
            yield from _thing(part, seen)
    elif isinstance(thing, ModuleType):
        yield f"module {thing.__name__}"
    elif hasattr(thing, "_defn"):  # an intrinsic of numba's
        yield "intrinsic"
        yield from _function(thing._defn, seen)
    else:
        yield " ".join([type(thing).__name__, *(str(getattr(thing, name, "")) for name in _NAMES)])


@dataclass(frozen=True, slots=True)
class Unit:
    """What becomes one object file: an entry point, or a helper that lies apart, for so many joints."""

    what: EntryPoint | Part
    joints: int

    @property
    def symbol(self) -> str:
        """Its name in the library."""
        return self.what.symbol

    def function(self) -> Any:
        """The helper, or the Python function of the entry point."""
        if isinstance(self.what, EntryPoint):
            return self.what.function(self.joints)
        return getattr(importlib.import_module(self.what.module), self.what.name)

    def key(self, target: Target) -> str:
        """A hash of everything that its machine code depends on."""
        function = self.function()
        if isinstance(self.what, EntryPoint):
            return key_of(function, self.symbol, self.what.signature, target)
        return key_of(function, self.symbol, self.what.arguments, function.long, target)

    def made(self, target: Target) -> tuple[bytes, list[Part]]:
        """Its object file, and the parts that it needs."""
        if isinstance(self.what, EntryPoint):
            return emit.entry_code(self.what, self.joints, target)
        return emit.part_code(self.what, self.function(), target)


class Store:
    """A folder of object files by what their code depends on, each with its hash and the parts it needs."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(mode=0o755, parents=True, exist_ok=True)
        facts = folder.stat()
        if hasattr(os, "getuid") and (facts.st_uid not in (0, os.getuid()) or facts.st_mode & 0o022):
            raise CannotBuild(
                f"{folder} belongs to another user, or others may write into it, and its files would be "
                "read and linked; remove it, or give another folder by --store"
            )

    def object_file(self, key: str) -> Path:
        """Where the object file of a key is."""
        return self._folder / f"{key}.o"

    def parts(self, key: str) -> list[Part] | None:
        """The parts that the unit of a key needs; ``None`` where it has to be compiled."""
        try:
            said, parts = pickle.loads((self._folder / f"{key}.parts").read_bytes())
            return list(parts) if said == fingerprint(self.object_file(key).read_bytes()) else None
        except Exception:  # there is none, or it is damaged: it is compiled anew
            return None

    def keep(self, key: str, code: bytes, parts: list[Part]) -> None:
        """Keep an object file."""
        store_lanes(self._folder / f"{key}.parts", pickle.dumps((fingerprint(code), parts)))
        store_lanes(self.object_file(key), code)

    def sweep(self, keys: set[str]) -> None:
        """Remove what has not been used for a month and is of no use now."""
        oldest = max((self.object_file(key).stat().st_mtime for key in keys), default=0.0) - 30 * 86_400
        for path in self._folder.glob("*.*"):
            if path.stem not in keys and path.suffix in (".o", ".parts") and path.stat().st_mtime < oldest:
                path.unlink(missing_ok=True)

    @contextlib.contextmanager
    def alone(self) -> Iterator[None]:
        """Inside, no other process builds with this store."""
        try:
            import fcntl
        except ImportError:
            yield
            return
        with (self._folder / "lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield


def _work(unit: Unit, key: str, target: Target, store: Store) -> list[Part]:
    """Compile a unit and keep its object file: the parts that it needs."""
    code, parts = unit.made(target)
    store.keep(key, code, parts)
    return parts


def compiled(
    wanted: Sequence[EntryPoint], target: Target, store: Store, jobs: int, joints: int = JOINTS,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[dict[Unit, str], int]:  # fmt: skip
    """Keys of all units that the wanted entry points need, every one compiled, and how many were just now."""
    patch_numba()
    keys: dict[Unit, str] = {}
    running: dict[Future[list[Part]], Unit] = {}
    todo = [Unit(one, joints) for one in wanted]
    made = 0
    pool = ProcessPoolExecutor(jobs, multiprocessing.get_context("fork")) if hasattr(os, "fork") else None
    try:
        while todo or running:
            for unit in todo:
                if unit in keys:
                    continue
                keys[unit] = key = unit.key(target)
                parts = store.parts(key)
                made += parts is None
                if parts is None and pool is not None:
                    future = pool.submit(_work, unit, key, target, store)
                else:
                    future = Future[list[Part]]()
                    future.set_result(_work(unit, key, target, store) if parts is None else parts)
                running[future] = unit
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            if progress is not None:
                progress(len(keys) - len(running) + len(done), len(keys))
            todo = []
            for future in done:
                unit = running.pop(future)
                try:
                    todo += [Unit(part, unit.joints) for part in future.result()]
                except (NumbaError, TypeError, RuntimeError, AssertionError) as error:
                    raise CannotBuild(f"{unit.symbol}: {error}") from error
            known = {one.symbol for one in keys}
            todo = [unit for unit in dict.fromkeys(todo) if unit.symbol not in known]
    finally:
        if pool is not None:
            pool.shutdown(cancel_futures=True)
    return keys, made


def linkers(target: BuildTarget | None = None) -> list[list[str]]:
    """The beginnings of the commands that may link a library for a target, or here, the best first."""
    zig = [[sys.executable, "-m", "ziglang", "cc"]] if importlib.util.find_spec("ziglang") else []
    if target is None:
        found = zig + [[name] for name in ("cc", "gcc", "clang") if which(name)]
    else:
        found = [[*one, "-target", target.zig] for one in zig]
    system = platform.system() if target is None else target.system
    free = {"Darwin": ["-undefined", "dynamic_lookup"], "Linux": []}.get(system)
    return [] if free is None else [[*one, "-shared", "-fPIC", "-O2", "-s", *free] for one in found]


def linked(files: Sequence[Path], target: BuildTarget | None = None) -> bytes:
    """The library of object files."""
    said, found = "", linkers(target)
    if not found:
        raise CannotBuild(NO_LINKER if target is None else NO_ZIG)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "kernel.so"
        for linker in found:
            done = subprocess.run(
                [*linker, str(GLUE), "-o", str(out), *map(str, files)],
                capture_output=True,
                text=True,
                check=False,
            )
            if done.returncode == 0:
                return out.read_bytes()
            said = f"{linker[0]} failed: {done.stderr.strip()[-300:]}"
    raise CannotBuild(said)


def build(
    out: Path, wanted: dict[str, Sequence[EntryPoint]], targets: Sequence[Target], source: Path,
    store: Store, *, jobs: int, checked: bool, ready: Callable[[], object] | None = None,
    away: BuildTarget | None = None,
) -> int:  # fmt: skip
    """Build a library for each class of processors and put them with their manifest into a folder."""
    if platform.system() not in ("Linux", "Darwin"):
        raise CannotBuild(f"nothing links it on {platform.system()}")
    if ready is None and not linkers(away):
        raise CannotBuild(NO_LINKER if away is None else NO_ZIG)
    before, made = code_key(source), 0
    libraries: list[dict[str, Any]] = []
    out.mkdir(parents=True, exist_ok=True)
    for target in targets:
        keys, count = compiled(wanted[target.cpu], target, store, jobs)
        made += count
        if ready is not None:
            ready()
            importlib.invalidate_caches()
        code = linked([store.object_file(key) for key in keys.values()], away)
        store.sweep(set(keys.values()))
        sha256 = fingerprint(code)
        file = f"kernel-{sha256[:12]}.so"
        entries = {one.symbol: [one.signature, one.nogil] for one in wanted[target.cpu]}
        libraries.append({"file": file, "level": target.cpu, "sha256": sha256, "entries": entries})
        store_lanes(out / file, code)
    if code_key(source) != before:
        raise CannotBuild("its source was changed while it was being built")
    facts = {} if away is None else away.facts
    describe(out, libraries=libraries, files=file_key(source) if checked else "", code=before, **facts)
    for path in out.glob("kernel-*.so"):
        if path.name not in {one["file"] for one in libraries}:
            path.unlink(missing_ok=True)
    return made
