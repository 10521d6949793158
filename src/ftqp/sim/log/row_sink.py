"""Where the rows of a run go: the role, and the one that keeps them in memory."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.signals import Column


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
class MemoryRows(RowSink):
    """Keeps rows in memory."""

    def __init__(self, columns: Sequence[Column], metadata: Mapping[str, Any]) -> None:
        self._columns = tuple(columns)
        self._metadata = dict(metadata)
        self._chunks: dict[int, FloatArray] = {}

    def write(self, first: int, rows: FloatArray) -> None:
        """Keep a copy of rows, (K, columns)."""
        self._chunks[first] = rows.copy()

    def annotate(self, metadata: Mapping[str, Any]) -> None:
        """Add or replace metadata."""
        self._metadata |= metadata

    def close(self) -> None:
        """Nothing has to be let go."""

    @property
    def log(self) -> Log:
        """All that has been kept so far."""
        chunks = [np.empty((0, len(self._columns))), *self._chunks.values()]
        return Log.of_table(None, np.concatenate(chunks), self._columns, self._metadata)
