"""The rows of a log, block after block, so that a long one need not fit into memory, and what keeps them."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn, final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.sim.log.signals import Column

EXACT = 2.0**53
"""Whole numbers below this are exact as float64."""


class RowSink(ABC):
    """The role of what keeps the rows of a run."""

    @abstractmethod
    def write(self, first: int, rows: FloatArray) -> None:
        """Keep rows, (K, columns); repeated with the same ``first``, they replace the earlier ones."""

    @abstractmethod
    def annotate(self, metadata: Mapping[str, Any]) -> None:
        """Add or replace metadata."""

    @abstractmethod
    def close(self) -> None:
        """Let go of the file, if there is one; nothing can be kept any more."""


@final
class RunFacts(dict[str, Any]):
    """What a log says of its run, by key; it is an error in a sentence to ask for what it does not say."""

    def __missing__(self, key: str) -> NoReturn:
        raise InputError(
            f"the log does not say {key!r} of its run, as every log of ftqp does; make it anew by ftqp run"
        )


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogRows:
    """The rows of a log, to be read as often as one likes."""

    path: Path | None  # The file; None for a log that was kept in memory
    columns: tuple[Column, ...]  # The signals, in the order of a row
    metadata: Mapping[str, Any]  # Scenario, robot, joints, limits, faults, versions and state of the run
    count: int  # Rows, one a tick
    # A function that reads the rows from one on, in blocks (K, columns) of float64
    read: Callable[[int], Iterator[FloatArray]]

    @property
    def title(self) -> str:
        """How a message names it."""
        return "log in memory" if self.path is None else f"log {self.path}"

    def blocks(self, first: int = 0) -> Iterator[FloatArray]:
        """The rows from ``first`` on in blocks (K, columns) of float64, to be read as often as one likes."""
        return self.read(first)

    @property
    def end(self) -> float:
        """The time of the last row [s]; 0 where there is none."""
        return float(next(self.blocks(self.count - 1))[0, self.groups()["t"][0]]) if self.count else 0.0

    def groups(self) -> dict[str, list[int]]:
        """Places in a row of the signals that have the same part before the first dot, by that part."""
        found: dict[str, list[int]] = {}
        for place, column in enumerate(self.columns):
            found.setdefault(column.name.split(".", 1)[0], []).append(place)
        return found

    def whole(self) -> list[bool]:
        """Which signals are codes and counts and hold nothing but whole numbers; reads all rows once."""
        result = np.array([column.integer for column in self.columns])
        for block in self.blocks():
            result &= whole_numbers(block)
        return [bool(exact) for exact in result]


def whole_numbers(block: FloatArray) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Which columns of a block (K, columns) hold nothing but whole numbers that are exact, (columns,)."""
    with np.errstate(invalid="ignore"):
        result: np.ndarray[Any, np.dtype[np.bool_]] = ((np.abs(block) < EXACT) & (block % 1.0 == 0.0)).all(
            axis=0
        )
    return result
