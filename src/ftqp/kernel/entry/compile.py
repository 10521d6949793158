"""Machine code of the entry points, made or loaded when it is first needed."""

from collections.abc import Callable, Iterable

from ftqp.kernel.compiled import kernel
from ftqp.kernel.compiled.entry_point import EntryPoint
from ftqp.kernel.compiled.kernel import Announce


def load(entry: EntryPoint, capacity: int) -> Callable[..., int]:
    """An entry point for one class of records.

    Args:
        entry: of the table.
        capacity: the class of records; ANY_SIZE for entries that know no robot.
    """
    return kernel.load(entry, capacity)


def compile_entries(entries: Iterable[EntryPoint], capacity: int, announce: Announce | None = None) -> None:
    """Make entry points ready, from disk or by compiling them.

    Args:
        entries: of the table.
        capacity: the class of records.
        announce: makes a context manager that is entered while something has to be compiled.
    """
    kernel.compile_ahead([(entry, capacity) for entry in entries], announce)
