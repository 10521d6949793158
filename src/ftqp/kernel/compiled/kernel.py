"""The kernel of a process: entry points of the built library, or plain Python."""

import logging
from collections.abc import Callable
from pathlib import Path

from ftqp.kernel.compiled import mode
from ftqp.kernel.compiled.library import REMEDY, EntryPoint, Library, NoLibrary, library_in

_LOG = logging.getLogger("ftqp")

BUILT = mode.KERNEL.parent / "_kernel"
"""The folder of the built library."""


class Kernel:
    """Entry points ready to be called, each made ready when it is first asked for.

    There is no lock: an exception that comes at the end of a block with a lock may leave it locked for ever.
    What two threads make ready at the same time is made twice, and the first is kept.

    Args:
        source: the folder with the kernel's Python source.
        built: the folder with the library, which need not exist.
    """

    def __init__(self, source: Path, built: Path) -> None:
        self._source = source
        self._built = built
        self._ready: dict[EntryPoint, Callable[..., int]] = {}
        self._found: tuple[Library | None] | None = (None,) if mode.PLAIN else None
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


_KERNEL = Kernel(mode.KERNEL, BUILT)


def load(entry: EntryPoint) -> Callable[..., int]:
    """An entry point of the kernel: as ``Kernel.load``."""
    return _KERNEL.load(entry)


def level() -> str:
    """The class of processors that the kernel in use was built for: as ``Kernel.level``."""
    return _KERNEL.level()
