"""Rows on their way to a file, of which a tally is kept, so that nothing has to be read again for it."""

from collections.abc import Mapping, Sequence
from typing import Any, final

from ftqp.core.checks import FloatArray
from ftqp.sim.log.row_sink import RowSink
from ftqp.sim.log.signal_blocks import Places, SignalBlock
from ftqp.sim.log.signals import Column
from ftqp.sim.log.tally import Tally


@final
class TalliedRows(RowSink):
    """Hands rows on, and keeps their tally."""

    def __init__(self, sink: RowSink, columns: Sequence[Column], metadata: Mapping[str, Any]) -> None:
        self._sink, self._metadata = sink, dict(metadata)
        self._places = Places(columns)
        self._tally = Tally(metadata, sensed="q_command" in self._places.groups)

    def write(self, first: int, rows: FloatArray) -> None:
        """Keep rows, (K, columns); repeated with the same ``first``, they count once."""
        self._sink.write(first, rows)
        if first == self._tally.count:
            self._tally = self._tally.after(SignalBlock(self._places, rows))

    def annotate(self, metadata: Mapping[str, Any]) -> None:
        """Add or replace metadata."""
        self._sink.annotate(metadata)
        self._metadata |= metadata

    def close(self) -> None:
        """Let go of the file."""
        self._sink.close()

    def facts(self) -> dict[str, Any]:
        """What happened in the run so far, ready for ``summary.json``."""
        return self._tally.facts(self._metadata)
