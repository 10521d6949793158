"""Builds the library of the kernel: units compiled in parallel, kept by what they depend on, and linked.

Objects are kept in a folder by a hash of what their code is made from, so that an edit compiles what it
concerns. The library and its manifest are put in their places at the end, whole, by renaming: whoever
interrupts a build, or builds at the same time, leaves the one before or the one behind.
"""

import contextlib
import importlib
import importlib.util
import json
import multiprocessing
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from shutil import which
from typing import Any

from numba.core.errors import NumbaError

from ftqp.kernel.building import kept_parts
from ftqp.kernel.building.fingerprint import fingerprint as key_of
from ftqp.kernel.building.quicker import be_quicker
from ftqp.kernel.compiled.library import MANIFEST, EntryPoint, code_key, file_key, fingerprint, platform_facts
from ftqp.kernel.compiled.making import emit
from ftqp.kernel.compiled.making.helper import Part
from ftqp.kernel.compiled.making.processor import Target
from ftqp.kernel.layout.enums import JOINTS

GLUE = Path(emit.__file__).parents[1] / "glue.c"
"""Compiled beside the units whenever they are linked."""
NO_LINKER = "neither ziglang nor cc is here to link it"


class CannotBuild(Exception):
    """The kernel cannot be built here; the message says why."""


@dataclass(frozen=True, slots=True)
class Unit:
    """What becomes one object file: an entry point, or a helper that lies apart.

    Attributes:
        what: which.
        joints: that the records which it works on have room for.
    """

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
    """Object files by what their code depends on.

    Args:
        folder: where they are kept; it is made if it is missing.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(mode=0o755, parents=True, exist_ok=True)

    def object_file(self, key: str) -> Path:
        """Where the object file of a key is."""
        return self._folder / f"{key}.o"

    def parts(self, key: str) -> list[Part] | None:
        """The parts that the unit of a key needs; ``None`` where it has to be compiled."""
        code, said = self.object_file(key), self._folder / f"{key}.json"
        try:
            return kept_parts.read(code.read_bytes(), said.read_bytes())
        except (OSError, ValueError):
            return None

    def keep(self, key: str, code: bytes, parts: list[Part]) -> None:
        """Keep an object file."""
        put(self._folder / f"{key}.json", kept_parts.written(code, parts))
        put(self.object_file(key), code)

    def sweep(self, keys: set[str]) -> None:
        """Remove what has not been used for a month and is of no use now."""
        oldest = max((self.object_file(key).stat().st_mtime for key in keys), default=0.0) - 30 * 86_400
        for path in self._folder.glob("*.*"):
            if (
                path.stem not in keys
                and path.suffix in (".o", ".json", ".parts")
                and path.stat().st_mtime < oldest
            ):
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


def put(path: Path, content: bytes) -> None:
    """Write a file in one go: there is all of it, or what was there before."""
    handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        raise


def _work(unit: Unit, key: str, target: Target, store: Store) -> list[Part]:
    """Compile a unit and keep its object file: the parts that it needs."""
    code, parts = unit.made(target)
    store.keep(key, code, parts)
    return parts


def compiled(
    wanted: Sequence[EntryPoint], target: Target, store: Store, jobs: int, joints: int = JOINTS
) -> tuple[dict[Unit, str], int]:
    """Keys of all units that the wanted entry points need, every one compiled, and how many were just now."""
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
                if parts is not None:
                    future: Future[list[Part]] = Future()
                    future.set_result(parts)
                elif pool is not None:
                    made += 1
                    future = pool.submit(_work, unit, key, target, store)
                else:
                    made += 1
                    future = Future()
                    future.set_result(_work(unit, key, target, store))
                running[future] = unit
            done, _ = wait(running, return_when=FIRST_COMPLETED)
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


def linkers() -> list[list[str]]:
    """The beginnings of the commands that may link a library on this machine, the best first."""
    zig = [[sys.executable, "-m", "ziglang", "cc"]] if importlib.util.find_spec("ziglang") else []
    found = zig + [[name] for name in ("cc", "gcc", "clang") if which(name)]
    free = {"Darwin": ["-undefined", "dynamic_lookup"], "Linux": []}.get(platform.system())
    return [] if free is None else [[*one, "-shared", "-fPIC", "-O2", "-s", *free] for one in found]


def linked(files: Sequence[Path]) -> bytes:
    """The library of object files."""
    said, found = "", linkers()
    if not found:
        raise CannotBuild(NO_LINKER)
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
) -> int:  # fmt: skip
    """Build a library for each class of processors and put them with their manifest into a folder."""
    if platform.system() not in ("Linux", "Darwin"):
        raise CannotBuild(f"nothing links it on {platform.system()}")
    if ready is None and not linkers():
        raise CannotBuild(NO_LINKER)
    before, made = code_key(source), 0
    libraries: list[dict[str, Any]] = []
    be_quicker()
    out.mkdir(parents=True, exist_ok=True)
    for target in targets:
        keys, count = compiled(wanted[target.cpu], target, store, jobs)
        made += count
        if ready is not None:
            ready()
            importlib.invalidate_caches()
        code = linked([store.object_file(key) for key in keys.values()])
        store.sweep(set(keys.values()))
        sha256 = fingerprint(code)
        file = f"kernel-{sha256[:12]}.so"
        entries = {one.symbol: [one.signature, one.nogil] for one in wanted[target.cpu]}
        libraries.append({"file": file, "level": target.cpu, "sha256": sha256, "entries": entries})
        put(out / file, code)
    if code_key(source) != before:
        raise CannotBuild("its source was changed while it was being built")
    manifest(out, libraries, file_key(source) if checked else "", before)
    for path in out.glob("kernel-*.so"):
        if path.name not in {one["file"] for one in libraries}:
            path.unlink(missing_ok=True)
    return made


def manifest(out: Path, libraries: list[dict[str, Any]], files: str, code: str, reason: str = "") -> None:
    """Write what is said of the libraries in a folder; with a reason, why there are none."""
    said = {**platform_facts(), "libraries": libraries, "files": files, "code": code, "reason": reason}
    out.mkdir(parents=True, exist_ok=True)
    put(out / MANIFEST, (json.dumps(said, indent=1, sort_keys=True) + "\n").encode())
