"""The results of a study in one SQLite file: a row an item, written by one process, read by anybody.

Table ``about`` holds one JSON value per key (format, kind of study, its key, its text), ``results`` one row
an item with its number, its values, the seconds that it took and the worker, and ``crashed`` the items at
which a worker died. An item has one row, whatever was computed twice; a process killed at any moment leaves
all rows that were written.
"""

import json
import sqlite3
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Self, final

from ftqp.core.errors import FtqpError, InputError

FILE_NAME = "results.sqlite"
LOCK_NAME = "writer.lock"
REMEDY = "name another folder by --out"
"""What to do where a folder cannot be used, unless its owner says something else."""
FORMAT = 1
"""Version of the file's layout."""
KINDS = {"REAL", "INTEGER", "TEXT"}
PATIENCE = 10.0
"""A reader of another process may keep the writer waiting so long [s]."""
_ABOUT = "CREATE TABLE about (key TEXT PRIMARY KEY, value TEXT NOT NULL)"
_RESULTS = "CREATE TABLE results (item INTEGER PRIMARY KEY,"
_CRASHED = "CREATE TABLE crashed (item INTEGER PRIMARY KEY, reason TEXT NOT NULL)"

Columns = Mapping[str, str]
"""Names of the values of an item with their types: REAL, INTEGER or TEXT."""


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
    ) -> None:
        self._remedy = remedy
        self.path = folder / FILE_NAME
        self._columns = dict(columns)
        facts = {"format": FORMAT, "kind": kind, "key": key} | dict(about or {})
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._lock = _locked(folder, remedy)
        except (sqlite3.Error, OSError) as error:
            raise _unusable(self.path, error, remedy) from error
        self._connection = sqlite3.connect(self.path, isolation_level=None, timeout=PATIENCE)
        try:
            self._open(facts)
        except (sqlite3.Error, OSError, UnicodeDecodeError) as error:
            self.close()
            raise _unusable(self.path, error, remedy) from error
        except BaseException:
            self.close()
            raise

    def _open(self, facts: Mapping[str, Any]) -> None:
        """The tables of this study, made now or found."""
        run = self._connection.execute
        run("PRAGMA trusted_schema = OFF")
        if self.path.stat().st_size == 0:
            self._make(facts)
        else:
            _check(self._connection, self.path, facts, self._columns, self._remedy)
        run("PRAGMA journal_mode = WAL")
        run("PRAGMA synchronous = NORMAL")

    def _make(self, facts: Mapping[str, Any]) -> None:
        """The tables, all or none."""
        run = self._connection.execute
        run("BEGIN")
        run(_ABOUT)
        run(_CRASHED)
        run(_results_table(self._columns))
        self._connection.executemany("INSERT INTO about VALUES (?, ?)", _encoded(facts))
        run("COMMIT")

    def done(self) -> set[int]:
        """The numbers of the items that have a row."""
        return {item for (item,) in self._connection.execute("SELECT item FROM results")}

    def count(self) -> int:
        """How many items have a row."""
        return int(self._connection.execute("SELECT count(*) FROM results").fetchone()[0])

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
        self._commit(f"INSERT OR IGNORE INTO results VALUES ({marks})", values)
        self._commit("DELETE FROM crashed WHERE item = ?", [(item,) for item in items])

    def crash(self, item: int, reason: str) -> None:
        """Note that the worker of an item died; it is tried again when the study is continued."""
        self._commit("INSERT OR REPLACE INTO crashed VALUES (?, ?)", [(item, reason)])

    def crashed(self) -> dict[int, str]:
        """The items at which a worker died, with the reason."""
        return dict(self._connection.execute("SELECT item, reason FROM crashed ORDER BY item"))

    def table(self) -> list[tuple[Any, ...]]:
        """All rows by item: its number, then its values."""
        names = ", ".join(_quoted(name) for name in ("item", *self._columns))
        try:
            return self._connection.execute(f"SELECT {names} FROM results ORDER BY item").fetchall()
        except sqlite3.Error as error:
            raise _unusable(self.path, "a row of it is damaged", self._remedy) from error

    def seconds(self) -> float:
        """What all items took together [s]."""
        (total,) = self._connection.execute("SELECT coalesce(sum(seconds), 0.0) FROM results").fetchone()
        return float(total)

    def _commit(self, statement: str, values: Iterable[tuple[Any, ...]]) -> None:
        """Everything or nothing."""
        try:
            if self._connection.in_transaction:
                self._connection.execute("ROLLBACK")
            self._connection.execute("BEGIN IMMEDIATE")
            self._connection.executemany(statement, values)
            self._connection.execute("COMMIT")
        except sqlite3.Error as error:
            raise FtqpError(
                f"results file {self.path} cannot be written: {error}; what was written before is kept, and "
                "the same command goes on from there"
            ) from error

    def close(self) -> None:
        """Let go of the file."""
        self._connection.close()
        self._lock.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _unusable(path: Path, error: Exception | str, remedy: str) -> InputError:
    """What to say of a file that cannot be used."""
    reason = getattr(error, "strerror", None) or error
    return InputError(f"{path} cannot be used as a results file: {reason}; {remedy}")


def _locked(folder: Path, remedy: str) -> sqlite3.Connection:
    """Holds the lock of a folder's only writer; the system lets it go when the process ends, however it does.

    Raises:
        InputError: Another process holds it.
    """
    lock = sqlite3.connect(folder / LOCK_NAME, isolation_level=None, timeout=0.0)
    try:
        lock.execute("BEGIN EXCLUSIVE")
    except sqlite3.OperationalError as error:
        lock.close()
        raise InputError(
            f"another process writes to {folder}; wait until it has ended, or {remedy}"
        ) from error
    return lock


def _facts(connection: sqlite3.Connection, path: Path) -> dict[str, Any]:
    """What the file says about its study, checked to be one that this ftqp can read.

    Raises:
        InputError: It is no results file, or a newer one.
    """
    made = dict(connection.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table'"))
    if made.get("about") != _ABOUT:
        raise InputError(f"{path} is not a results file of ftqp: it has no table about as such a file has it")
    rows = connection.execute("SELECT key, substr(value, 1, 2000000) FROM about LIMIT 1000").fetchall()
    try:
        facts = {str(key): json.loads(value) for key, value in rows}
    except (ValueError, TypeError, RecursionError) as error:
        raise InputError(f"{path} is not a results file of ftqp: its table about is damaged") from error
    version = facts.get("format")
    if not isinstance(version, int) or isinstance(version, bool) or version < 1:
        raise InputError(f"{path} is not a results file of ftqp: its format is {version!r:.40}")
    if version > FORMAT:
        raise InputError(
            f"{path} has format {version}, this ftqp reads up to {FORMAT}; a newer ftqp made it and can go on"
        )
    return facts


def _check(
    connection: sqlite3.Connection,
    path: Path,
    wanted: Mapping[str, Any],
    columns: Mapping[str, str],
    remedy: str,
) -> None:
    """That the file is of this very study.

    Raises:
        InputError: It is not.
    """
    facts = _facts(connection, path)
    if facts.get("kind") != wanted["kind"]:
        raise InputError(
            f"{path} holds results of a study of kind {facts.get('kind')!r:.40}, this one is of kind "
            f"{wanted['kind']!r}; {remedy}"
        )
    if facts.get("ftqp") != wanted.get("ftqp"):
        raise InputError(
            f"{path} was made by ftqp {facts.get('ftqp')!s:.40}, this is {wanted.get('ftqp')}, and their "
            f"results are not mixed; {remedy}, or continue it with that version"
        )
    made = dict(connection.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table'"))
    same = made.get("results") == _results_table(columns) and made.get("crashed") == _CRASHED
    if facts.get("key") != wanted["key"] or not same:
        raise InputError(f"{path} holds results of another study{_difference(facts, wanted)}; {remedy}")


def _difference(facts: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    """The first line in which the texts of two studies differ; the number of episodes is none."""
    there, here = (
        [line for line in str(of.get("study", "")).splitlines() if not line.startswith("episodes = ")]
        for of in (facts, wanted)
    )
    for old, new in zip(there, here, strict=False):
        if old != new:
            return f" ({old.strip()!r:.60} there, {new.strip()!r:.60} here)"
    return ""


def refuse_other_tables(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse a file whose results are no table, but for example a view that never ends.

    Args:
        connection: To the file.
        path: The file.

    Raises:
        InputError: It has no such table.
    """
    made = dict(connection.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table'"))
    if not str(made.get("results")).startswith(_RESULTS):
        raise InputError(f"{path} has no table results as a results file of ftqp has it; name another folder")


def _results_table(columns: Mapping[str, str]) -> str:
    """The statement that makes the table of results."""
    for name, kind in columns.items():
        if kind not in KINDS:
            raise ValueError(f"column {name} has type {kind!r}, expected one of {sorted(KINDS)}")
    listed = ", ".join(f"{_quoted(name)} {kind}" for name, kind in columns.items())
    return f"{_RESULTS} {listed}, seconds REAL, worker TEXT)"


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


def _encoded(facts: Mapping[str, Any]) -> list[tuple[str, str]]:
    return [(key, json.dumps(value, allow_nan=False)) for key, value in facts.items()]
