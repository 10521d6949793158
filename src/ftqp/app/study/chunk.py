"""A chunk of a study: some of its items, computed by one worker in one go."""

import os
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from ftqp.app.output.termination import no_interrupt_lost
from ftqp.core.clock import now

Work = Callable[[Sequence[int]], list[tuple[Any, ...]]]
"""Computes the rows of some items; it can be pickled, and a row depends on its item alone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Done:
    """A chunk with its rows.

    Attributes:
        items: Numbers of the items.
        rows: Their values.
        seconds: What it took [s].
        worker: Who computed it: host and process.
    """

    items: tuple[int, ...]
    rows: list[tuple[Any, ...]]
    seconds: float
    worker: str


def compute(work: Work, items: Sequence[int]) -> Done:
    """The rows of some items, with the time they took.

    Args:
        work: What computes them.
        items: Numbers of the items.
    """
    began = now()
    with no_interrupt_lost():
        rows = work(items)
    worker = f"{socket.gethostname()}:{os.getpid()}"
    return Done(items=tuple(items), rows=rows, seconds=(now() - began) * 1e-9, worker=worker)
