"""Reads a log file: opened read-only, its tables and checksums checked before anything is believed."""

import json
import os
import sqlite3
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

from ftqp.control.planner.status import StepStatus
from ftqp.core.checks import FloatArray, instance, non_negative
from ftqp.core.errors import InputError, unknown
from ftqp.kernel.layout.thresholds import TIME_SLACK
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.log_parts import FILE_NAME, joined, log_files
from ftqp.sim.log.log_rows import LogRows
from ftqp.sim.log.log_writer import FORMAT, PATIENCE, TABLES
from ftqp.sim.log.raw_rows import BLOCK
from ftqp.sim.log.run_facts import RunFacts, strange_fact
from ftqp.sim.log.side_files import strange_side_file
from ftqp.sim.log.signals import Column

MOST_COLUMNS, MOST_FACTS = 2000, 1000
"""Signals and metadata that a log has at most."""
LARGEST_VALUE = 16_000_000
"""Bytes of a value in the file at most, apart from the rows' blobs."""
OF_EACH_JOINT = ("q", "v", "a", "tau", "tau_brake", "lb", "ub", "belief", "truth")
"""Groups of signals of which each joint has one."""
LARGEST_CODE = 2.0**53
"""Codes and counts are below this, and no NaN."""
FIRST_TABLES = {
    "columns": "CREATE TABLE columns (name TEXT PRIMARY KEY, unit TEXT, description TEXT)",
    "metadata": "CREATE TABLE metadata (key TEXT PRIMARY KEY, value TEXT)",
}
"""Tables of format 1, in which a table ``log`` had one column a signal."""


class _NotALog(Exception):
    """Why a file is no log."""


def load_log(
    path: str | Path,
    *,
    begin: float | None = None,
    end: float | None = None,
    signals: Sequence[str] | None = None,
) -> Log:
    """The log in a file, or in the folder of a run, or a portion of it.

    Only the portion is held in memory, so a log may be larger than that.

    Args:
        path: The file, or the folder of a run: its ``log.sqlite``, with the parts before it if there are any.
        begin: No row before this time is loaded [s]; all from the first on without it.
        end: No row after this time is loaded [s]; all to the last without it.
        signals: Names of what is loaded, single signals or groups such as ``"q"``; all without it.

    Raises:
        InputError: No such file, not a log of ftqp, a damaged one, an unknown signal, or more than fits into
            the memory of this machine.
    """
    with open_log(path) as rows:
        places = _places(rows, signals)
        first, last = _portion(rows, begin, end)
        size = 8 * (last - first) * len(places)
        if size > physical_memory():
            raise InputError(
                f"{rows.title} takes {size / 1e9:.1f} GB in memory, and this machine has "
                f"{physical_memory() / 1e9:.1f} GB; load a portion of it with begin and end, some of its "
                "signals, or one of its parts"
            )
        table, at = np.empty((len(places), last - first)), 0
        for block in rows.blocks(first):
            kept = block[: last - first - at]
            table[:, at : at + len(kept)] = kept.T[places]
            at += len(kept)
            if at == last - first:
                break
        return Log.of_table(rows.path, table.T, [rows.columns[k] for k in places], rows.metadata)


def _places(rows: LogRows, signals: Sequence[str] | None) -> list[int]:
    """Places in a row of some signals, of all without them."""
    if signals is None:
        return list(range(len(rows.columns)))
    instance("signals", signals, list | tuple, 'names such as ["t", "q"]')
    groups = rows.groups() | {column.name: [place] for place, column in enumerate(rows.columns)}
    for name in signals:
        if name not in groups:
            raise unknown("signal", name, rows.title, rows.groups())
    return [place for name in signals for place in groups[name]]


def _portion(rows: LogRows, begin: float | None, end: float | None) -> tuple[int, int]:
    """The numbers of the first row within a time, and of the first one behind it."""
    if begin is None and end is None:
        return 0, rows.count
    names = [column.name for column in rows.columns]
    if "t" not in names:
        raise InputError(f"{rows.title} has no signal t, so begin and end cannot be found; leave them out")
    place = names.index("t")

    def time(row: int) -> float:
        return float(next(rows.blocks(row))[0, place])

    def first_at(limit: float) -> int:
        return bisect_left(range(rows.count), limit, key=time)

    low = 0 if begin is None else first_at(non_negative("begin", begin, "s") - TIME_SLACK)
    high = rows.count if end is None else first_at(non_negative("end", end, "s") + TIME_SLACK)
    return low, max(low, high)


def physical_memory() -> float:
    """Bytes of memory that this machine has; infinite where it does not say."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return float("inf")


@contextmanager
def open_log(path: str | Path) -> Iterator[LogRows]:
    """The rows of a log, which are read while the context lasts, block after block.

    Args:
        path: The file, or the folder of a run: its ``log.sqlite``, with the parts before it if there are any.
    """
    instance("path", path, str | Path, "the path of a log or of the folder of a run")
    given = Path(path)
    folder = os.path.isdir(given)  # a name that is too long is none
    files = log_files(given) if folder else [given]
    if not files or not os.path.isfile(files[0]):
        file = given / FILE_NAME if folder else given
        raise InputError(f"log {file} does not exist; expected a {FILE_NAME} or the folder of a run")
    if len(files) > 1:
        yield joined(given, files, _one_file)
        return
    with _one_file(files[0]) as rows:
        yield rows


@contextmanager
def _one_file(file: Path) -> Iterator[LogRows]:
    """The rows of one file."""
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
    _refuse_other_joints(columns, metadata.get("joints"))
    count = _count(connection) if chunked else connection.execute("SELECT count(*) FROM log").fetchone()[0]
    blocks = _chunks if chunked else _first_blocks

    def read(first: int) -> Iterator[FloatArray]:
        with _judged(file):
            yield from blocks(connection, columns, first)

    return LogRows(path=file, columns=tuple(columns), metadata=metadata, count=count, read=read)


@contextmanager
def _opened(file: Path) -> Iterator[sqlite3.Connection]:
    """The file, read-only; but one whose writer was killed in the middle of a write is first put in order."""
    if side := strange_side_file(file):
        raise _NotALog(f"{side.name} beside it is no regular file; delete that one, if it is not yours")
    address = file.absolute().as_uri()
    for mode in ("ro", "rw"):
        reader = sqlite3.connect(f"{address}?mode={mode}", uri=True, timeout=PATIENCE)
        with closing(reader) as connection:
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


def _refuse_other_joints(columns: Sequence[Column], joints: Sequence[str] | None) -> None:
    """Refuse groups of signals of a joint each that are not of the joints of the run."""
    for group in OF_EACH_JOINT if joints is not None else ():
        named = [column.name for column in columns if column.name.startswith(f"{group}.")]
        if named and named != [f"{group}.{joint}" for joint in joints or ()]:
            raise _NotALog(f"its signals {group} are not of its joints, {', '.join(joints or ())!s:.100}")


def _metadata(connection: sqlite3.Connection) -> dict[str, Any]:
    """What the run was about."""
    found = connection.execute(f"SELECT key, value FROM metadata LIMIT {MOST_FACTS + 1}").fetchall()
    if len(found) > MOST_FACTS:
        raise _NotALog(f"it has more than {MOST_FACTS} metadata")
    metadata = {str(key): json.loads(value) for key, value in found}
    version = metadata.get("format", FORMAT)
    if version not in range(1, FORMAT + 1):
        raise _NotALog(f"it has format {version!r:.20}, expected 1 to {FORMAT}; a newer ftqp may read it")
    if strange := strange_fact(metadata):
        raise _NotALog(strange)
    return RunFacts(metadata)


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


def _chunks(connection: sqlite3.Connection, columns: Sequence[Column], begin: int) -> Iterator[FloatArray]:
    """The rows from one on, (K, columns) each; every chunk is measured before it is read, and then checked.

    No lock is held between two chunks: the run may be going on.
    """
    width, codes = len(columns), [k for k, column in enumerate(columns) if column.integer]
    status = [k for k, column in enumerate(columns) if column.name == "status" and column.integer]
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, max(LARGEST_VALUE, 8 * BLOCK * width + 1000))
    measured = connection.execute(
        "SELECT first, rows, crc, typeof(data), length(data) FROM chunks WHERE first + rows > ? "
        "ORDER BY first",
        (begin,),
    ).fetchall()
    for first, rows, crc, kind, size in measured:
        if kind != "blob" or size != 8 * rows * width:
            raise _NotALog(f"its chunk at row {first} has {size} bytes, expected {8 * rows * width}")
        found = connection.execute("SELECT data FROM chunks WHERE first = ?", (first,)).fetchall()
        if len(found) != 1 or crc32(found[0][0]) != crc:
            raise _NotALog(f"its chunk at row {first} is damaged, its checksum differs")
        block = np.frombuffer(found[0][0], dtype="<f8").reshape(rows, width)
        if not (np.abs(block[:, codes]) < LARGEST_CODE).all():
            raise _NotALog(f"its chunk at row {first} has a code or a count that is no number")
        if status and not ((block[:, status] >= 0.0) & (block[:, status] < len(StepStatus))).all():
            raise _NotALog(f"its chunk at row {first} has a status that no step has")
        yield block[max(begin - first, 0) :]


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


def _first_blocks(
    connection: sqlite3.Connection, columns: Sequence[Column], begin: int
) -> Iterator[FloatArray]:
    """Rows of a log of format 1, from one on."""
    listed = ", ".join('"' + column.name.replace('"', '""') + '"' for column in columns)
    cursor = connection.execute(f"SELECT {listed} FROM log ORDER BY k LIMIT -1 OFFSET ?", (begin,))
    while rows := cursor.fetchmany(BLOCK):
        yield np.array(rows, dtype=np.float64)
