"""A log in memory: arrays by name, with units and metadata."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Self, final

import numpy as np
from numpy.typing import NDArray

from ftqp.core.checks import FloatArray, frozen, seen
from ftqp.core.errors import MissingPackage, unknown
from ftqp.core.picture import Picture, painted
from ftqp.core.small_picture import curves_svg, html_table
from ftqp.sim.log.log_rows import LogRows, RowSink, RunFacts, whole_numbers
from ftqp.sim.log.raw_rows import BLOCK
from ftqp.sim.log.signals import Column
from ftqp.sim.log.table_files import write_csv, write_mat, write_npz

SHOWN = 12
"""So many signals are listed in a notebook: time, status, errors and the first of the joints."""


@final
class Log:
    """A log in memory: arrays by name, with units and metadata.

    ``log["q.panda_joint1"]`` is one signal, (K,); ``log["q"]`` stacks all signals ``q.*``, (K, nv).

    Attributes:
        path: the file it was read from; None for a log that was kept in memory.
        units: unit of each signal.
        descriptions: sentence of each signal.
        metadata: scenario, robot, joints, limits, faults, versions and state of the run.
    """

    def __init__(
        self,
        path: Path | None,
        signals: Mapping[str, NDArray[Any]],
        units: Mapping[str, str],
        descriptions: Mapping[str, str],
        metadata: Mapping[str, Any],
    ) -> None:
        self.path = path
        self.units = dict(units)
        self.descriptions = dict(descriptions)
        self.metadata = RunFacts(metadata)
        self._signals = {name: seen(signal) for name, signal in signals.items()}
        self._stacks: dict[str, NDArray[Any]] = {}

    @classmethod
    def of_table(
        cls, path: Path | None, table: FloatArray, columns: Sequence[Column], metadata: Mapping[str, Any]
    ) -> Self:
        """The log of a table, one row a tick, (K, columns); a signal of whole numbers is of integers."""
        signals: dict[str, NDArray[Any]] = {}
        for index, column in enumerate(columns):
            signal = np.ascontiguousarray(
                table[:, index]
            )  # nothing is copied of a table that lies by columns
            whole = column.integer and bool(whole_numbers(signal[:, None])[0])
            signals[column.name] = signal.astype(np.int64) if whole else signal
        return cls(
            path,
            signals,
            {column.name: column.unit for column in columns},
            {column.name: column.description for column in columns},
            metadata,
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all signals, in the order of the file."""
        return tuple(self._signals)

    @property
    def title(self) -> str:
        """How a message names it."""
        return "log in memory" if self.path is None else f"log {self.path}"

    def __repr__(self) -> str:
        """What was run, how long, and how far it can be looked at."""
        about = [str(self.metadata.get(name) or "") for name in ("scenario", "robot")]
        last = f", {float(self['t'][-1]):g} s" if len(self) else ""
        name = " ".join(part for part in about if part)
        return f"Log({name!r}, {len(self)} rows{last}, {len(self.units)} signals)"

    def _repr_html_(self) -> str:
        """What was run, and the extremes of what is looked at first, for notebooks."""
        rows = [
            (name, f"{float(np.min(self[name])):.4g}", f"{float(np.max(self[name])):.4g}", self.units[name])
            for name in self.names[:SHOWN]
            if len(self)
        ]
        more = f"and {len(self.names) - SHOWN} more: log.names" if len(self.names) > SHOWN else ""
        return html_table(
            repr(self), ("signal", "least", "most", "unit"), rows, more, self.error_svg() if len(self) else ""
        )

    def error_svg(self) -> str:
        """The tip's distance from its target over time, small; empty where there is none."""
        if "position_error" not in self._signals or not len(self):
            return ""
        error = self["position_error"]
        says = f"distance from the target over {float(self['t'][-1]):g} s, at most {1e3 * error.max():.3g} mm"
        return curves_svg([(self["t"], error)], says)

    def plot(self, figure: str = "path") -> Picture:
        """One of the figures of the run as a picture, which a notebook shows and ``.save(file)`` keeps.

        Args:
            figure: ``path``, ``joints``, ``velocities`` or ``status``, and where the run has them ``tasks``,
                ``following``, ``torques`` and ``base``.

        Raises:
            InputError: The log has no rows, or no such figure.
            MissingPackage: matplotlib is not installed.
        """
        picture: Picture = painted("run", self, figure)
        return picture

    def __len__(self) -> int:
        return len(next(iter(self._signals.values())))

    def __contains__(self, name: object) -> bool:
        return name in self._signals

    def __getitem__(self, name: str) -> NDArray[Any]:
        """One signal, (K,), or the stack of those that begin with ``name`` and a dot, (K, count)."""
        if name in self._signals:
            return self._signals[name]
        if name not in self._stacks:
            parts = [signal for key, signal in self._signals.items() if key.startswith(name + ".")]
            if not parts:
                groups = dict.fromkeys(key.split(".", 1)[0] for key in self._signals)
                raise unknown("signal", name, self.title, groups)
            self._stacks[name] = frozen(np.stack(parts, axis=1))
        return self._stacks[name]

    @property
    def rows(self) -> LogRows:
        """The same as blocks of rows."""
        return LogRows(
            path=self.path,
            columns=tuple(
                Column(name, self.units[name], self.descriptions[name], signal.dtype == np.int64)
                for name, signal in self._signals.items()
            ),
            metadata=self.metadata,
            count=len(self),
            read=self._blocks,
        )

    def _blocks(self, begin: int) -> Iterator[FloatArray]:
        for first in range(begin, len(self), BLOCK):
            parts = [signal[first : first + BLOCK] for signal in self._signals.values()]
            yield np.stack(parts, axis=1).astype(np.float64)

    def to_csv(self, path: str | Path) -> None:
        """Write all signals to a new CSV file, one row per step, names in the first line.

        Raises:
            InputError: the file exists already or cannot be made.
        """
        write_csv(self.rows, path)

    def to_pandas(self) -> Any:
        """All signals as a ``pandas.DataFrame``, one row per step with the time [s] as its index.

        Raises:
            MissingPackage: pandas is not installed.
        """
        try:
            import pandas
        except ImportError as error:
            raise MissingPackage("a table of pandas", "pandas", "pip install pandas") from error
        return pandas.DataFrame(self._signals).set_index("t")

    def to_npz(self, path: str | Path) -> None:
        """Write all signals to a new NPZ file, an array a group: ``q`` is (K, nv), ``t`` is (K,).

        ``about`` is a JSON text with the names, units and sentences of the signals and the metadata.

        Raises:
            InputError: the file exists already or cannot be made.
        """
        write_npz(self.rows, path)

    def to_mat(self, path: str | Path) -> None:
        """Write all signals to a new MAT file for MATLAB or Octave, a variable a group: ``q`` is (K, nv).

        ``signals`` and ``units`` are structs of cell arrays, ``metadata`` is a JSON text.

        Raises:
            InputError: the file exists already, cannot be made, or the log is too long for MAT.
        """
        write_mat(self.rows, path)


@final
class MemoryRows(RowSink):
    """Keeps rows in memory."""

    def __init__(self, columns: Sequence[Column], metadata: Mapping[str, Any]) -> None:
        self._columns = tuple(columns)
        self._metadata = dict(metadata)
        self._chunks: dict[int, FloatArray] = {}

    def write(self, first: int, rows: FloatArray) -> None:
        self._chunks[first] = rows.copy()

    def annotate(self, metadata: Mapping[str, Any]) -> None:
        self._metadata |= metadata

    def close(self) -> None:
        """Nothing has to be let go."""

    @property
    def log(self) -> Log:
        """All that has been kept so far."""
        chunks = [np.empty((0, len(self._columns))), *self._chunks.values()]
        return Log.of_table(None, np.concatenate(chunks), self._columns, self._metadata)
