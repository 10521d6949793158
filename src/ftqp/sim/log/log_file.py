"""The log of a simulation: one SQLite file that any tool can read and that survives a killed process.

Table ``log`` has one column per signal and one row per step, ``columns`` the unit and description of each,
and ``metadata`` one JSON value per key (scenario, robot, limits, faults, versions, state of the run).
"""

import csv
import json
import sqlite3
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self, final

import numpy as np
from numpy.typing import NDArray

from ftqp.core import clock
from ftqp.core.checks import FloatArray
from ftqp.core.errors import FtqpError, InputError, unknown
from ftqp.sim.log.signals import Column

FILE_NAME = "log.sqlite"
COMMIT_PERIOD = 1_000_000_000
"""Rows wait at most this long before they are on file [ns of wall time]."""
BLOCK = 4096
"""Rows that are buffered at most."""


@final
class LogWriter:
    """Writes rows to a new log file and commits them once a second or every 4096 rows.

    A process killed at any moment leaves a file with every committed row.

    Args:
        path: the file to make; it must not exist.
        columns: the signals, in the order of a row.
        metadata: anything JSON can hold, by key.

    Raises:
        InputError: the file exists already or cannot be made.
    """

    def __init__(self, path: str | Path, columns: Sequence[Column], metadata: Mapping[str, Any]) -> None:
        self.path = Path(path)
        if self.path.exists():
            raise InputError(
                f"log file {self.path} exists already; choose another folder, logs are never overwritten"
            )
        try:
            self._connection = sqlite3.connect(self.path, isolation_level=None)
            self._make_tables(columns, metadata)
        except sqlite3.Error as error:
            raise InputError(f"log file {self.path} cannot be made: {error}") from error
        self._insert = f"INSERT OR REPLACE INTO log VALUES ({', '.join('?' * (1 + len(columns)))})"
        self._block: FloatArray = np.full((BLOCK, len(columns)), np.nan)
        self._filled = 0
        self._written = 0
        self._committed_at = clock.now()

    def _make_tables(self, columns: Sequence[Column], metadata: Mapping[str, Any]) -> None:
        """The three tables, on file before the first step."""
        run = self._connection.execute
        run("PRAGMA synchronous = OFF")
        signals = ", ".join(
            f'"{column.name}" {"INTEGER" if column.integer else "REAL"}' for column in columns
        )
        run("BEGIN")
        run(f"CREATE TABLE log (k INTEGER PRIMARY KEY, {signals})")
        run("CREATE TABLE columns (name TEXT PRIMARY KEY, unit TEXT, description TEXT)")
        run("CREATE TABLE metadata (key TEXT PRIMARY KEY, value TEXT)")
        self._connection.executemany(
            "INSERT INTO columns VALUES (?, ?, ?)", [(c.name, c.unit, c.description) for c in columns]
        )
        self._connection.executemany("INSERT INTO metadata VALUES (?, ?)", _encoded(metadata))
        run("COMMIT")

    @property
    def rows(self) -> int:
        """How many rows have been appended."""
        return self._written + self._filled

    @property
    def row(self) -> FloatArray:
        """The row to fill before `append`, (columns,); it starts as NaN, which the file holds as NULL."""
        row: FloatArray = self._block[self._filled]
        return row

    def append(self) -> None:
        """Keep `row` and go to the next."""
        self._filled += 1
        if self._filled == BLOCK or clock.now() - self._committed_at > COMMIT_PERIOD:
            self.flush()

    def flush(self) -> None:
        """Put all rows on file. Interrupted at any point, it can be called again.

        Raises:
            FtqpError: the file cannot be written, for example because the disk is full.
        """
        rows = self._block[: self._filled].tolist()
        keyed = [(self._written + k, *row) for k, row in enumerate(rows)]
        try:
            if self._connection.in_transaction:
                self._connection.execute("ROLLBACK")
            self._connection.execute("BEGIN")
            self._connection.executemany(self._insert, keyed)
            self._connection.execute("COMMIT")
        except sqlite3.Error as error:
            raise FtqpError(f"log file {self.path} cannot be written: {error}") from error
        self._written, self._filled = self._written + len(rows), 0
        self._block.fill(np.nan)
        self._committed_at = clock.now()

    def annotate(self, metadata: Mapping[str, Any]) -> None:
        """Add or replace metadata."""
        try:
            self._connection.executemany("INSERT OR REPLACE INTO metadata VALUES (?, ?)", _encoded(metadata))
        except sqlite3.Error as error:
            raise FtqpError(f"log file {self.path} cannot be written: {error}") from error

    def close(self) -> None:
        """Put all rows on file and close it."""
        self.flush()
        self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


@final
class Log:
    """A log in memory: arrays by name, with units and metadata.

    ``log["q.panda_joint1"]`` is one signal, (K,); ``log["q"]`` stacks all signals ``q.*``, (K, nv).

    Attributes:
        path: the file it was read from.
        units: unit of each signal.
        descriptions: sentence of each signal.
        metadata: scenario, robot, joints, limits, faults, versions and state of the run.
    """

    def __init__(
        self,
        path: Path,
        signals: Mapping[str, NDArray[Any]],
        units: Mapping[str, str],
        descriptions: Mapping[str, str],
        metadata: Mapping[str, Any],
    ) -> None:
        self.path = path
        self.units = dict(units)
        self.descriptions = dict(descriptions)
        self.metadata = dict(metadata)
        self._signals = dict(signals)
        self._stacks: dict[str, NDArray[Any]] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all signals, in the order of the file."""
        return tuple(self._signals)

    def __len__(self) -> int:
        return len(next(iter(self._signals.values())))

    def __contains__(self, name: object) -> bool:
        return name in self._signals

    def __getitem__(self, name: str) -> NDArray[Any]:
        """One signal, (K,), or the stack of those that begin with ``name`` and a dot, (K, count).

        Raises:
            InputError: no such signal.
        """
        if name in self._signals:
            return self._signals[name]
        if name not in self._stacks:
            parts = [signal for key, signal in self._signals.items() if key.startswith(name + ".")]
            if not parts:
                groups = dict.fromkeys(key.split(".", 1)[0] for key in self._signals)
                raise unknown("signal", name, f"log {self.path}", groups)
            self._stacks[name] = np.stack(parts, axis=1)
        return self._stacks[name]

    def to_csv(self, path: str | Path) -> None:
        """Write all signals to a new CSV file, one row per step, names in the first line.

        Raises:
            InputError: the file exists already or cannot be made.
        """
        try:
            with Path(path).open("x", newline="", encoding="utf-8") as file:
                writer = csv.writer(file)
                writer.writerow(self._signals)
                writer.writerows(zip(*(signal.tolist() for signal in self._signals.values()), strict=True))
        except FileExistsError as error:
            raise InputError(f"file {path} exists already; choose another name") from error
        except OSError as error:
            raise InputError(f"file {path} cannot be written: {error.strerror}") from error


def load_log(path: str | Path) -> Log:
    """The log in a file, or in the folder of a run.

    Raises:
        InputError: no such file, or not a log of ftqp.
    """
    file = Path(path)
    file = file / FILE_NAME if file.is_dir() else file
    if not file.is_file():
        raise InputError(f"log {file} does not exist; expected a {FILE_NAME} or the folder of a run")
    try:
        connection = sqlite3.connect(file)
        try:
            described = connection.execute("SELECT name, unit, description FROM columns").fetchall()
            metadata = {key: json.loads(value) for key, value in connection.execute("SELECT * FROM metadata")}
            declared = {row[1]: row[2] for row in connection.execute("PRAGMA table_info(log)")}
            names = [name for name, *_ in described if name in declared]
            listed = ", ".join(f'"{name}"' for name in names)
            rows = connection.execute(f"SELECT {listed} FROM log ORDER BY k").fetchall()
        finally:
            connection.close()
    except (sqlite3.Error, ValueError) as error:
        raise InputError(f"{file} is not a log of ftqp: {error}") from error
    table = np.array(rows, dtype=np.float64).reshape(len(rows), len(names))
    signals: dict[str, NDArray[Any]] = {}
    for index, name in enumerate(names):
        signal = np.ascontiguousarray(table[:, index])
        whole = declared[name] == "INTEGER" and not np.isnan(signal).any()
        signals[name] = signal.astype(np.int64) if whole else signal
    return Log(
        file,
        signals,
        {name: unit for name, unit, _ in described},
        {name: description for name, _, description in described},
        metadata,
    )


def _encoded(metadata: Mapping[str, Any]) -> list[tuple[str, str]]:
    return [(key, json.dumps(value, allow_nan=False)) for key, value in metadata.items()]
