"""The one message of a first use: the kernel is being compiled."""

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from ftqp.kernel.entry.compile import compile_entries
from ftqp.kernel.entry.table import ENTRIES

NOTICE = "ftqp: compiling its kernel for this machine, once (`ftqp warmup` does it ahead) ..."


@contextmanager
def _notice() -> Iterator[None]:
    if sys.stderr.isatty():
        from rich.console import Console

        with Console(stderr=True).status(NOTICE):
            yield
    else:
        sys.stderr.write(NOTICE + "\n")
        sys.stderr.flush()
        yield


def warm_up(names: Iterable[str], capacity: int) -> None:
    """Compile entry points, or load them from disk; the user is told when something has to be compiled.

    Args:
        names: of the entry points.
        capacity: the class of records.
    """
    compile_entries([ENTRIES[name] for name in names], capacity, _notice)
