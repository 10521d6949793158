"""Work for the tests of studies: small, picklable, and deadly where a test wants it."""

import os
import signal
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

COLUMNS = {"square": "INTEGER", "root": "REAL", "name": "TEXT"}
"""What ``Squares`` computes of an item."""


@dataclass(frozen=True)
class Squares:
    """Squares and roots of item numbers.

    Attributes:
        seconds: how long an item takes [s].
        deadly: the item at which the worker kills itself.
        all_deadly_below: the item below which each is deadly.
        fails: the item at which the work raises.
    """

    seconds: float = 0.0
    deadly: int = -1
    all_deadly_below: int = 0
    fails: int = -1

    def __call__(self, items: Sequence[int]) -> list[tuple[Any, ...]]:
        rows = []
        for item in items:
            if item == self.deadly or item < self.all_deadly_below:
                os.kill(os.getpid(), signal.SIGKILL)
            if item == self.fails:
                raise ArithmeticError(f"item {item} cannot be computed")
            time.sleep(self.seconds)
            rows.append((item * item, item**0.5, f"item {item}"))
        return rows


def expected(count: int) -> list[tuple[Any, ...]]:
    """The whole table of ``count`` items."""
    return [(item, item * item, item**0.5, f"item {item}") for item in range(count)]
