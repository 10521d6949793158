"""Writes the log of a run into one SQLite file, in chunks of rows.

Table ``columns`` names the signals, ``metadata`` holds one JSON value per key (format, how to read the rows,
scenario, robot, limits, faults, versions, state of the run), and ``chunks`` the rows: each ``data`` is a
block of little-endian float64, one row a tick, one number a signal, with its CRC-32.
"""

import json
import sqlite3
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Self, final
from zlib import crc32

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import FtqpError, InputError
from ftqp.sim.log.row_sink import RowSink
from ftqp.sim.log.signals import Column
from ftqp.sim.log.whole_files import whole_file

PATIENCE = 60.0
"""A reader of another process may keep the writer waiting so long [s]."""
REMEDY = "choose another folder, logs are never overwritten"
FORMAT = 2
"""Version of the log's layout."""
TABLES = {
    "columns": "CREATE TABLE columns (place INTEGER PRIMARY KEY, name TEXT UNIQUE NOT NULL, "
    "unit TEXT NOT NULL, description TEXT NOT NULL, integer INTEGER NOT NULL)",
    "metadata": "CREATE TABLE metadata (key TEXT PRIMARY KEY, value TEXT NOT NULL)",
    "chunks": "CREATE TABLE chunks (first INTEGER PRIMARY KEY, rows INTEGER NOT NULL, crc INTEGER NOT NULL, "
    "data BLOB NOT NULL)",
}
"""The tables by name, exactly as they are made."""
READING = (
    "names = [name for (name,) in connection.execute('SELECT name FROM columns ORDER BY place')]; "
    "table = numpy.concatenate([numpy.frombuffer(data, '<f8').reshape(-1, len(names)) "
    "for (data,) in connection.execute('SELECT data FROM chunks ORDER BY first')])"
)
"""How any Python with sqlite3 and numpy reads the rows."""


@final
class LogWriter(RowSink):
    """A new log file; every write is on file when it returns.

    A process killed at any moment leaves a file with every row that was written, or none at all if it had not
    been made yet.

    Raises:
        InputError: the file exists already or cannot be made.
    """

    def __init__(self, path: str | Path, columns: Sequence[Column], metadata: Mapping[str, Any]) -> None:
        self.path = Path(path)
        about = {"format": FORMAT, "layout": "chunks of float64 rows", "reading": READING}
        try:
            with whole_file(self.path, "log file", REMEDY) as part, closing(_opened(part)) as made:
                _make_tables(made, columns, about | dict(metadata))
            self._connection = _opened(self.path)
        except (sqlite3.Error, UnicodeError) as error:
            raise InputError(f"log file {self.path} cannot be made: {error}") from error

    def write(self, first: int, rows: FloatArray) -> None:
        """Put rows on file. Interrupted at any point, it can be called again.

        Raises:
            FtqpError: the file cannot be written, for example because the disk is full.
        """
        data = np.ascontiguousarray(rows, dtype="<f8").tobytes()
        self._commit(
            "INSERT OR REPLACE INTO chunks VALUES (?, ?, ?, ?)", [(first, len(rows), crc32(data), data)]
        )

    def annotate(self, metadata: Mapping[str, Any]) -> None:
        """Add or replace metadata.

        Raises:
            FtqpError: the file cannot be written.
        """
        self._commit("INSERT OR REPLACE INTO metadata VALUES (?, ?)", _encoded(metadata))

    def _commit(self, statement: str, values: Sequence[tuple[Any, ...]]) -> None:
        """Everything or nothing."""
        try:
            with self._connection:
                self._connection.executemany(statement, values)
        except sqlite3.Error as error:
            raise FtqpError(f"log file {self.path} cannot be written: {error}") from error

    def close(self) -> None:
        """Let go of the file."""
        self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _opened(path: Path) -> sqlite3.Connection:
    """A connection that outlives a kill of its process, though not a loss of power."""
    connection = sqlite3.connect(path, timeout=PATIENCE)
    connection.execute("PRAGMA synchronous = OFF")
    return connection


def _make_tables(
    connection: sqlite3.Connection, columns: Sequence[Column], metadata: Mapping[str, Any]
) -> None:
    """The tables, on file before the first step."""
    with connection:
        for statement in ("BEGIN", *TABLES.values()):
            connection.execute(statement)
        connection.executemany(
            "INSERT INTO columns VALUES (?, ?, ?, ?, ?)",
            [(k, c.name, c.unit, c.description, int(c.integer)) for k, c in enumerate(columns)],
        )
        connection.executemany("INSERT INTO metadata VALUES (?, ?)", _encoded(metadata))


def _encoded(metadata: Mapping[str, Any]) -> list[tuple[str, str]]:
    return [(key, json.dumps(value, allow_nan=False)) for key, value in metadata.items()]
