"""The one message of a first use: the kernel is being compiled."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from ftqp.kernel.entry.compile import (
    BASE,
    CLOSED_FORM,
    EXTERNAL,
    NETWORK,
    RATES,
    SETUP,
    STEP,
    compile_entries,
)

NOTICE = "ftqp: compiling its kernel for this machine, once (20 to 60 s; `ftqp warmup` does it ahead) ..."
"""One planner's entry points take about 20 s of CPU on a core of 2026, more where other work shares it."""


@contextmanager
def notice() -> Iterator[None]:
    """Says on stderr that the kernel is being compiled, on a terminal with a spinner until it is done."""
    if sys.stderr.isatty():
        from rich.console import Console

        with Console(stderr=True).status(NOTICE):
            yield
    else:
        sys.stderr.write(NOTICE + "\n")
        sys.stderr.flush()
        yield


def warm_up(
    *, external: bool = True, network: bool = True, closed_form: bool = True, base: bool = True
) -> None:
    """Compile whatever a planner needs, or load it from disk.

    Args:
        external: also what planners with an external backend need.
        network: also what planners with the backend ``dtrnn`` need.
        closed_form: also what planners with a closed form need.
        base: also what a moving base needs.
    """
    more = (
        *(EXTERNAL if external else ()),
        *(NETWORK if network else ()),
        *(CLOSED_FORM if closed_form else ()),
        *(BASE if base else ()),
    )
    compile_entries((*SETUP, *STEP, *more), notice)


def warm_up_rates() -> None:
    """Compile what the closed forms without a planner need, or load it from disk."""
    compile_entries(RATES, notice)
