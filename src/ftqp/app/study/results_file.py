"""The results of a study in one SQLite file: a row an item, written by one process, read by anybody.

Table ``about`` holds one JSON value per key (format, kind of study, its key, its text), ``results`` one row
an item with its number, its values, the seconds that it took and the worker, and ``crashed`` the items at
which a worker died. An item has one row, whatever was computed twice; a process killed at any moment leaves
all rows that were written.
"""

import os
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path
from typing import Any, Self, final

from ftqp.app.study.results_layout import (
    CURE,
    CURED,
    FORMAT,
    Columns,
    code,
    make_tables,
    quoted,
    reason,
    refuse_other_studies,
)
from ftqp.core.errors import FtqpError, InputError
from ftqp.sim.log.side_files import strange_side_file

FILE_NAME = "results.sqlite"
LOCK_NAME = "writer.lock"
REMEDY = "name another folder by --out"
"""What to do where a folder cannot be used, unless its owner says something else."""
EVERY = 2**63 - 1
"""No item has a number as large as this."""
MEANT = {"REAL": "a number", "INTEGER": "a whole number", "TEXT": "a text"}
"""What a column of a type holds, in words."""
PATIENCE = 10.0
"""A reader of another process may keep the writer waiting so long [s]."""
_CRASH = "INSERT OR REPLACE INTO crashed VALUES (?, ?)"
_CLEAR = "DELETE FROM crashed WHERE item = ?"


@final
class ResultsFile:
    """A study's results, open for one writer.

    Args:
        folder: The folder of the study; it is made if need be, and one with results of this study goes on.
        kind: The kind of study, for example ``workspace``.
        key: What tells this study from every other one, for example a hash of its text.
        columns: The values of an item.
        about: More about the study, anything JSON can hold, by key.
        remedy: What a person can do where the folder cannot be used, for messages.
        onward: What goes on where this ended; None is the same command with ``--out`` and the folder.

    Attributes:
        path: Of the file.
        onward: What goes on where this ended.

    Raises:
        InputError: The file is of another study, of a newer version or no results file at all, another
            process writes to it, or it cannot be made.
    """

    def __init__(
        self,
        folder: Path,
        *,
        kind: str,
        key: str,
        columns: Columns,
        about: Mapping[str, Any] | None = None,
        remedy: str = REMEDY,
        onward: str | None = None,
    ) -> None:
        self._remedy = remedy
        self.onward = onward or f"the same command with --out {folder}"
        self.path = folder / FILE_NAME
        self._columns = dict(columns)
        facts = {"format": FORMAT, "kind": kind, "key": key} | dict(about or {})
        with _readable(self.path, remedy), ExitStack() as opened:
            _refuse_strange_files(self.path)
            folder.mkdir(parents=True, exist_ok=True)
            opened.enter_context(closing(locked(folder, remedy)))
            connection = sqlite3.connect(self.path, isolation_level="IMMEDIATE", timeout=PATIENCE)
            self._connection = opened.enter_context(closing(connection))
            opened.callback(self._leave_log)
            self._connection.execute("PRAGMA trusted_schema = OFF")
            if self.path.stat().st_size == 0:
                make_tables(self._connection, facts, self._columns)
            else:
                refuse_other_studies(self._connection, self.path, facts, self._columns, remedy)
            self._connection.execute("PRAGMA journal_mode = WAL")
            self._connection.execute("PRAGMA synchronous = NORMAL")
            self._opened = opened.pop_all()

    def done(self) -> set[int]:
        """The numbers of the items that have a row.

        Raises:
            InputError: The file cannot be read, as it is damaged or the disk is full.
        """
        return {item for (item,) in self._read("SELECT item FROM results")}

    def count(self, below: int = EVERY) -> int:
        """How many items with numbers below this one have a row."""
        return int(self._read("SELECT count(*) FROM results WHERE item < ?", below)[0][0])

    def write(self, items: Sequence[int], rows: Sequence[Sequence[Any]], seconds: float, worker: str) -> None:
        """Put the rows of a chunk on file, all or none; an item that has a row keeps it.

        Args:
            items: Numbers of the items.
            rows: Their values, in the order of the columns.
            seconds: What the chunk took [s].
            worker: Who computed it.

        Raises:
            FtqpError: The file cannot be written, for example because the disk is full.
        """
        share = seconds / max(len(items), 1)
        marks = ", ".join("?" * (len(self._columns) + 3))
        values = [(item, *row, share, worker) for item, row in zip(items, rows, strict=True)]
        self._commit(
            {f"INSERT OR IGNORE INTO results VALUES ({marks})": values, _CLEAR: [(item,) for item in items]}
        )

    def crash(self, items: Sequence[int], why: str) -> None:
        """Note items at which a process died, or may die; whoever continues the study tries them again."""
        self._commit({_CRASH: [(item, why) for item in items]})

    def clear(self, items: Sequence[int]) -> None:
        """Forget that a process died, or might have died, at items."""
        self._commit({_CLEAR: [(item,) for item in items]})

    def crashed(self) -> dict[int, str]:
        """The items at which a worker died, or a process that computed them itself, with the reason."""
        return dict(self._read("SELECT item, reason FROM crashed ORDER BY item"))

    def table(self) -> list[tuple[Any, ...]]:
        """All rows by item: its number, then its values, each empty or of its column's type.

        Raises:
            InputError: A value is of another type, or the file is damaged.
        """
        names = ", ".join(quoted(name) for name in ("item", *self._columns))
        self._refuse_other_types()
        return self._read(f"SELECT {names} FROM results ORDER BY item")

    def _refuse_other_types(self) -> None:
        """That items have numbers from 0 on and values their types, which SQLite leaves to whoever writes."""
        for (item,) in self._read("SELECT item FROM results WHERE item < 0 LIMIT 1"):
            raise self.wrong(item, "item", item, "a number from 0 on")
        for name, kind in self._columns.items():
            asked = f"SELECT item, substr({quoted(name)}, 1, 100) FROM results WHERE typeof({quoted(name)}) "
            for item, value in self._read(f"{asked} NOT IN (?, 'null') LIMIT 1", kind.lower()):
                raise self.wrong(item, name, value, MEANT[kind])

    def wrong(self, item: int, column: str, value: Any, expected: str) -> InputError:
        """What to say of a value that the study did not write."""
        return InputError(
            f"row {item} of {self.path} has {value!r:.60} as {column}, expected {expected}; take it out by "
            f'sqlite3 FILE "DELETE FROM results WHERE item = {item}", and it is computed anew'
        )

    def seconds(self, below: int = EVERY) -> float:
        """What all items with numbers below this one took together [s]."""
        asked = "SELECT coalesce(sum(seconds), 0.0) FROM results WHERE item < ?"
        return float(self._read(asked, below)[0][0])

    def _read(self, asked: str, *values: Any) -> list[tuple[Any, ...]]:
        """What the file answers."""
        with _readable(self.path, self._remedy):
            return self._connection.execute(asked, values).fetchall()

    def _commit(self, changes: Mapping[str, Iterable[tuple[Any, ...]]]) -> None:
        """Everything or nothing: statements with the values for which each is run."""
        try:
            with self._connection:
                for statement, values in changes.items():
                    self._connection.executemany(statement, values)
        except sqlite3.Error as error:
            raise FtqpError(
                f"results file {self.path} cannot be written: {reason(error)}; what was written before is "
                f"kept, and {self.onward} goes on from there"
            ) from error

    def _leave_log(self) -> None:
        """Makes it a file that can be read where nobody can write."""
        with suppress(sqlite3.Error):  # somebody reads it, or the disk is full: it is as good as it was
            self._connection.execute("PRAGMA busy_timeout = 0")
            self._connection.execute("PRAGMA journal_mode = DELETE")

    def close(self) -> None:
        """Let go of the file, as one that can be read where nobody can write."""
        self._opened.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@contextmanager
def _readable(path: Path, remedy: str) -> Iterator[None]:
    """Says in a sentence why a file cannot be used."""
    try:
        yield
    except (sqlite3.Error, OSError, UnicodeDecodeError) as error:
        why = reason(error) if code(error) or isinstance(error, OSError) else "a row of it is damaged"
        cure = f"{CURE}, or " if code(error) in CURED else ""
        raise InputError(f"{path} cannot be used as a results file: {why}; {cure}{remedy}") from error


def locked(folder: Path, remedy: str) -> sqlite3.Connection:
    """The lock of a folder's only writer; the system lets it go when the process ends, however it does."""
    file = folder / LOCK_NAME
    _refuse_strange_files(file)
    lock = sqlite3.connect(file, isolation_level=None, timeout=0.0)
    try:
        lock.execute("BEGIN EXCLUSIVE")
    except sqlite3.Error as error:
        lock.close()
        if code(error) in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
            why = f"another process writes to {folder}; wait until it has ended, or {remedy}"
        elif code(error) in CURED:
            why = f"folder {folder} cannot be written: {reason(error)}; {CURE}, or {remedy}"
        else:
            why = f"{file} is not the lock that ftqp keeps there: {reason(error)}; delete it"
        raise InputError(why) from error
    return lock


def read_only(file: Path) -> sqlite3.Connection:
    """A connection to a file that is only read, also one of an older ftqp in a folder that nobody can write.

    Raises:
        InputError: A file beside it is a pipe or another one at which SQLite would wait.
    """
    _refuse_strange_files(file)
    logged = file.with_name(f"{file.name}-wal").exists()
    still = not logged and not os.access(file.parent, os.W_OK)
    how = "immutable=1" if still else "mode=ro"
    return sqlite3.connect(f"{file.resolve().as_uri()}?{how}", uri=True)


def _refuse_strange_files(file: Path) -> None:
    """Refuses a pipe or the like in the place of a database, or of what SQLite opens beside it."""
    mine = file.is_file() or not (file.exists() or file.is_symlink())
    if strange := strange_side_file(file) if mine else file:
        raise InputError(
            f"{file} cannot be used: {strange.name} is no regular file; delete it, if it is not yours"
        )
