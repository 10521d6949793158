"""Reads a log file: opened read-only, its tables and checksums checked before anything is believed."""

import json
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

from ftqp.core.checks import FloatArray, instance
from ftqp.core.errors import InputError
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.log_rows import LogRows
from ftqp.sim.log.log_writer import FORMAT, TABLES
from ftqp.sim.log.raw_rows import BLOCK
from ftqp.sim.log.signals import Column

FILE_NAME = "log.sqlite"
MOST_COLUMNS, MOST_FACTS = 2000, 1000
"""Signals and metadata that a log has at most."""
LARGEST_VALUE = 16_000_000
"""Bytes of a value in the file at most, apart from the rows' blobs."""
FIRST_TABLES = {
    "columns": "CREATE TABLE columns (name TEXT PRIMARY KEY, unit TEXT, description TEXT)",
    "metadata": "CREATE TABLE metadata (key TEXT PRIMARY KEY, value TEXT)",
}
"""Tables of format 1, in which a table ``log`` had one column a signal."""


class _NotALog(Exception):
    """Why a file is no log."""


def load_log(path: str | Path) -> Log:
    """The log in a file, or in the folder of a run.

    Args:
        path: The file, or the folder of a run in which it is ``log.sqlite``.

    Raises:
        InputError: no such file, not a log of ftqp, or a damaged one.
    """
    with open_log(path) as rows:
        table = np.concatenate([np.empty((0, len(rows.columns))), *rows.blocks()])
        return Log.of_table(rows.path, table, rows.columns, rows.metadata)


@contextmanager
def open_log(path: str | Path) -> Iterator[LogRows]:
    """The rows of a log, which are read while the context lasts, block after block.

    Args:
        path: The file, or the folder of a run in which it is ``log.sqlite``.

    Raises:
        InputError: no such file, not a log of ftqp, or a damaged one; of damaged rows when they are read.
    """
    instance("path", path, str | Path, "the path of a log or of the folder of a run")
    file = Path(path)
    file = file / FILE_NAME if file.is_dir() else file
    if not file.is_file():
        raise InputError(f"log {file} does not exist; expected a {FILE_NAME} or the folder of a run")
    with ExitStack() as open_files:
        with _judged(file):
            connection = open_files.enter_context(_opened(file))
            rows = _rows(file, connection)
        yield rows


@contextmanager
def _judged(file: Path) -> Iterator[None]:
    """What goes wrong while a file is read says that it is no log."""
    try:
        yield
    except _NotALog as error:
        raise InputError(f"{file} is not a log of ftqp: {error}") from error
    except (sqlite3.Error, ValueError, TypeError, RecursionError, OverflowError) as error:
        raise InputError(f"{file} is not a log of ftqp: {error!s:.200}") from error


def _rows(file: Path, connection: sqlite3.Connection) -> LogRows:
    """What a file holds, its tables looked at."""
    made = dict(connection.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table'"))
    chunked = "chunks" in made
    for name, statement in (TABLES if chunked else FIRST_TABLES).items():
        if made.get(name) != statement:
            raise _NotALog(f"it has no table {name} as a log has it")
    metadata = _metadata(connection)
    columns = _columns(connection) if chunked else _first_columns(connection)
    count = _count(connection) if chunked else connection.execute("SELECT count(*) FROM log").fetchone()[0]
    blocks = _chunks if chunked else _first_blocks

    def read() -> Iterator[FloatArray]:
        with _judged(file):
            yield from blocks(connection, columns)

    return LogRows(path=file, columns=tuple(columns), metadata=metadata, count=count, blocks=read)


@contextmanager
def _opened(file: Path) -> Iterator[sqlite3.Connection]:
    """The file, read-only; but one whose writer was killed in the middle of a write is first put in order."""
    address = file.absolute().as_uri()
    for mode in ("ro", "rw"):
        with closing(sqlite3.connect(f"{address}?mode={mode}", uri=True)) as connection:
            try:
                connection.execute("PRAGMA trusted_schema = OFF")
                connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
            except sqlite3.OperationalError as error:
                if mode == "ro" and error.sqlite_errorcode == sqlite3.SQLITE_READONLY_ROLLBACK:
                    continue
                raise
            connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_VALUE)
            yield connection
            return


def _metadata(connection: sqlite3.Connection) -> dict[str, Any]:
    """What the run was about."""
    found = connection.execute(f"SELECT key, value FROM metadata LIMIT {MOST_FACTS + 1}").fetchall()
    if len(found) > MOST_FACTS:
        raise _NotALog(f"it has more than {MOST_FACTS} metadata")
    metadata = {str(key): json.loads(value) for key, value in found}
    version = metadata.get("format", FORMAT)
    if version not in range(1, FORMAT + 1):
        raise _NotALog(f"it has format {version!r:.20}, expected 1 to {FORMAT}; a newer ftqp may read it")
    return metadata


def _columns(connection: sqlite3.Connection) -> list[Column]:
    """The signals in their order."""
    found = connection.execute(
        f"SELECT name, unit, description, integer FROM columns ORDER BY place LIMIT {MOST_COLUMNS + 1}"
    ).fetchall()
    if not 1 <= len(found) <= MOST_COLUMNS:
        raise _NotALog(f"it has {'no' if not found else 'too many'} signals, expected 1 to {MOST_COLUMNS}")
    try:
        return [Column(str(name), str(unit), str(text), bool(whole)) for name, unit, text, whole in found]
    except InputError as error:
        raise _NotALog(str(error)) from error


def _count(connection: sqlite3.Connection) -> int:
    """How many rows there are; the chunks follow each other."""
    count = 0
    for first, rows in connection.execute("SELECT first, rows FROM chunks ORDER BY first"):
        if first != count or not isinstance(rows, int) or not 1 <= rows <= BLOCK:
            raise _NotALog(f"its chunk at row {first!r:.20} does not follow row {count - 1}")
        count += rows
    return count


def _chunks(connection: sqlite3.Connection, columns: Sequence[Column]) -> Iterator[FloatArray]:
    """All rows, (K, columns) each; every chunk is measured before it is read, and checked before the next."""
    width = len(columns)
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, max(LARGEST_VALUE, 8 * BLOCK * width + 1000))
    measured = connection.execute(
        "SELECT first, rows, crc, typeof(data), length(data) FROM chunks ORDER BY first"
    )
    for first, rows, crc, kind, size in measured:
        if kind != "blob" or size != 8 * rows * width:
            raise _NotALog(f"its chunk at row {first} has {size} bytes, expected {8 * rows * width}")
        (data,) = connection.execute("SELECT data FROM chunks WHERE first = ?", (first,)).fetchone()
        if crc32(data) != crc:
            raise _NotALog(f"its chunk at row {first} is damaged, its checksum differs")
        yield np.frombuffer(data, dtype="<f8").reshape(rows, width)


def _first_columns(connection: sqlite3.Connection) -> list[Column]:
    """Signals of a log of format 1."""
    kind = connection.execute("SELECT type, sql FROM sqlite_master WHERE name = 'log'").fetchone()
    if (
        kind is None
        or kind[0] != "table"
        or not kind[1].startswith("CREATE TABLE log (k INTEGER PRIMARY KEY")
    ):
        raise _NotALog("it has no table log as a log has it")
    declared = {
        name: form for _, name, form, _, _, _, hidden in connection.execute("PRAGMA table_xinfo(log)")
        if not hidden
    }  # fmt: skip
    described = connection.execute(
        f"SELECT name, unit, description FROM columns LIMIT {MOST_COLUMNS + 1}"
    ).fetchall()
    columns = [
        Column(name, unit, text, declared[name] == "INTEGER")
        for name, unit, text in described
        if name in declared
    ]
    if not columns or len(described) > MOST_COLUMNS:
        raise _NotALog("its signals are not described")
    return columns


def _first_blocks(connection: sqlite3.Connection, columns: Sequence[Column]) -> Iterator[FloatArray]:
    """Rows of a log of format 1."""
    listed = ", ".join('"' + column.name.replace('"', '""') + '"' for column in columns)
    cursor = connection.execute(f"SELECT {listed} FROM log ORDER BY k")
    while rows := cursor.fetchmany(BLOCK):
        yield np.array(rows, dtype=np.float64)
