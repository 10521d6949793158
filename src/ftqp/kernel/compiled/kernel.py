"""The compiled kernel of a process: from a wheel's library, from our folder, or compiled now."""

import logging
import os
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from threading import RLock
from typing import Any

from ftqp.kernel.compiled import folder, mode
from ftqp.kernel.compiled.entry_point import EntryPoint
from ftqp.kernel.compiled.stored import is_whole, packed, unpacked
from ftqp.kernel.compiled.wheel import Library, library_of

_LOG = logging.getLogger("ftqp")

Announce = Callable[[], AbstractContextManager[Any]]
Wanted = tuple[EntryPoint, int]
"""An entry point and the capacity of the records that it works on."""


class Kernel:
    """Entry points ready to be called, each made ready once.

    Args:
        source: the folder with the Python source that entry points are compiled from; a change in any of its
            files compiles anew.
        ahead: the folder with the library of a wheel, which need not exist; ``None`` looks for none.
    """

    def __init__(self, source: Path, ahead: Path | None = None) -> None:
        self._source = source
        self._ahead = ahead
        self._ready: dict[Wanted, Callable[..., int]] = {}
        self._lock = RLock()
        self._warned = folder.Warned()
        self._refused: set[Path] = set()
        self._library: Library | None = None
        self._library_was_sought = False
        self._key = ""
        self._folder: Path | None = None
        self._folder_was_sought = False

    def load(self, entry: EntryPoint, capacity: int, announce: Announce | None = None) -> Callable[..., int]:
        """An entry point for records of a capacity, compiled if need be.

        Args:
            entry: which.
            capacity: how many joints the records have room for.
            announce: makes a context manager that is entered while something is compiled.
        """
        self.compile_ahead([(entry, capacity)], announce)
        return self._ready[entry, capacity]

    def missing(self, wanted: Iterable[Wanted]) -> list[Wanted]:
        """Those that have to be compiled, being neither in this process nor in a library nor on disk."""
        with self._lock:
            return [one for one in wanted if not self._found(one)]

    def compile_ahead(self, wanted: Iterable[Wanted], announce: Announce | None = None) -> None:
        """Make several entry points ready, and keep on disk what had to be compiled.

        Args:
            wanted: entry points with capacities.
            announce: makes a context manager that is entered while something is compiled.
        """
        with self._lock:
            missing = self.missing(wanted)
            if not missing:
                return
            with nullcontext() if announce is None else announce():
                for one in missing:
                    self._ready[one] = self._compiled(*one)

    def _found(self, one: Wanted) -> bool:
        """Whether it is ready, or was made ready without compiling."""
        if one in self._ready:
            return True
        entry, capacity = one
        function = self._from_library(entry, capacity)
        if function is None and not mode.COMPILED:
            function = entry.function(capacity)
        if function is None:
            function = self._from_disk(entry, capacity)
        if function is None:
            return False
        self._ready[one] = function
        return True

    def _from_library(self, entry: EntryPoint, capacity: int) -> Callable[..., int] | None:
        if mode.PLAIN or self._ahead is None:
            return None
        if not self._library_was_sought:
            self._library_was_sought = True
            self._library = library_of(self._ahead, self._source_key())
        return None if self._library is None else self._library.function(entry, capacity)

    def _from_disk(self, entry: EntryPoint, capacity: int) -> Callable[..., int] | None:
        from ftqp.kernel.compiled.machine_code import linked_function

        place = self._place(entry, capacity)
        if place is None:
            return None
        content = folder.read_own(place)
        if content is None:
            if os.path.isfile(place):
                self._refuse(place, "is no file of yours that only you can write")
            return None
        code = unpacked(content, self._facts(entry, capacity))
        if code is None:
            if not is_whole(content):
                self._refuse(place, "is damaged")
            return None
        return linked_function(code, entry.symbol(capacity))

    def _refuse(self, place: Path, problem: str) -> None:
        """Say once that a file is not used."""
        if place not in self._refused:
            self._refused.add(place)
            folder.refused(place, problem)

    def _compiled(self, entry: EntryPoint, capacity: int) -> Callable[..., int]:
        from ftqp.kernel.compiled.machine_code import linked_function
        from ftqp.kernel.compiled.making.guard import lean_is_possible, plainly_compiled

        if not lean_is_possible():
            return plainly_compiled(entry, capacity)
        from ftqp.kernel.compiled.making.emit import object_code
        from ftqp.kernel.compiled.making.processor import this_machine

        code = object_code(
            entry.function(capacity),
            symbol=entry.symbol(capacity),
            signature=entry.signature,
            nogil=entry.nogil,
            target=this_machine(),
            capacity=capacity,
        )
        function = linked_function(code, entry.symbol(capacity))
        if function is None:
            _LOG.warning("the compiled code of %s needs what this process does not have", entry.name)
            return plainly_compiled(entry, capacity)
        place = self._place(entry, capacity)
        if place is not None:
            problem = folder.write_own(place, packed(self._facts(entry, capacity), code))
            if problem:
                self._warned.say(problem)
        return function

    def _source_key(self) -> str:
        if not self._key:
            self._key = mode.source_key(self._source)
        return self._key

    def _place(self, entry: EntryPoint, capacity: int) -> Path | None:
        """The file of an entry point, in a folder that was found to be ours; ``None`` where there is none."""
        kept = self.kept_in()
        return None if kept is None else kept / f"{entry.name}-{capacity}.kernel"

    def kept_in(self) -> Path | None:
        """The folder in which what had to be compiled is kept; ``None`` where there is none."""
        if not self._folder_was_sought:
            self._folder_was_sought = True
            self._folder = self._own_folder()
        return self._folder

    def _own_folder(self) -> Path | None:
        try:
            return folder.own(folder.own(folder.home()) / f"kernel-{self._source_key()}")
        except (RuntimeError, ValueError) as error:
            self._warned.say(str(error))
        except OSError as error:
            self._warned.say(" ".join(str(part) for part in (error.filename, error.strerror) if part))
        return folder.private_folder()

    def _facts(self, entry: EntryPoint, capacity: int) -> dict[str, Any]:
        """What the code of an entry point is made from and for."""
        from ftqp.kernel.compiled.making.processor import this_machine

        target = this_machine()
        return {
            "entry": entry.name,
            "capacity": capacity,
            "symbol": entry.symbol(capacity),
            "signature": entry.signature,
            "nogil": entry.nogil,
            "source": self._source_key(),
            "python": mode.python_tag(),
            "numba": mode.version_of("numba"),
            "llvmlite": mode.version_of("llvmlite"),
            "triple": target.triple,
            "cpu": target.cpu,
            "features": target.features,
        }


_KERNEL = Kernel(mode.KERNEL, mode.KERNEL / "ahead")


def load(entry: EntryPoint, capacity: int, announce: Announce | None = None) -> Callable[..., int]:
    """An entry point of the kernel for records of a capacity: as ``Kernel.load``."""
    return _KERNEL.load(entry, capacity, announce)


def missing(wanted: Iterable[Wanted]) -> list[Wanted]:
    """Those entry points that have to be compiled: as ``Kernel.missing``."""
    return _KERNEL.missing(wanted)


def compile_ahead(wanted: Iterable[Wanted], announce: Announce | None = None) -> None:
    """Make several entry points of the kernel ready: as ``Kernel.compile_ahead``."""
    _KERNEL.compile_ahead(wanted, announce)


def kept_in() -> Path | None:
    """The folder in which compiled entry points of the kernel are kept: as ``Kernel.kept_in``."""
    return _KERNEL.kept_in()
