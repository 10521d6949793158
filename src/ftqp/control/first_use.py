"""What of the kernel is compiled when, and the one message of a first use."""

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Final

from ftqp.core.errors import InputError
from ftqp.kernel.entry.compile import compile_entries
from ftqp.kernel.entry.table import ANY_SIZE, COMMON, ENTRIES
from ftqp.kernel.layout.record import CAPACITIES, capacity_for

NOTICE = "ftqp: compiling its kernel for this machine, once (20 to 60 s; `ftqp warmup` does it ahead) ..."
"""One planner's entry points take about 20 s of CPU on a core of 2026, more where other work shares it."""

ALONE: Final = (
    "write_target",
    *(name for name, entry in ENTRIES.items() if entry.module == ENTRIES["kkt"].module),
)
"""The entry points that know no robot."""


_told = False
"""Whether a log or a pipe has been told already; a terminal shows it as long as it lasts."""


@contextmanager
def notice() -> Iterator[None]:
    """Tell the user that something is being compiled: a terminal every time, anything else once."""
    global _told
    if sys.stderr.isatty():
        from rich.console import Console

        with Console(stderr=True).status(NOTICE):
            yield
    else:
        if not _told:
            _told = True
            sys.stderr.write(NOTICE + "\n")
            sys.stderr.flush()
        yield


def warm_up(names: Iterable[str], capacity: int) -> None:
    """Compile entry points, or load them from disk; the user is told when something has to be compiled.

    Args:
        names: of the entry points.
        capacity: the class of records.
    """
    compile_entries([ENTRIES[name] for name in names], capacity, notice)


def ahead(joints: int | None) -> list[tuple[str, int]]:
    """Entry points and classes of records that are worth compiling ahead.

    Args:
        joints: those of the arm that is to be driven, 1 to 32; None is everything that there is, for every
            arm.

    Raises:
        InputError: no arm has so many joints.
    """
    if joints is not None:
        if joints < 1:
            raise InputError(f"joints is {joints}, expected a whole number from 1")
        return [*((name, capacity_for(joints)) for name in COMMON), ("write_target", ANY_SIZE)]
    robots = [(name, capacity) for capacity in CAPACITIES for name in ENTRIES if name not in ALONE]
    return robots + [(name, ANY_SIZE) for name in ALONE]


def compile_one(name: str, capacity: int) -> None:
    """Compile one entry point, or load it from disk, without a word."""
    compile_entries([ENTRIES[name]], capacity)
