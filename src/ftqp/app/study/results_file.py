"""The results of a study in one SQLite file: a row an item, written by one process, read by anybody.

Table ``about`` holds one JSON value per key (format, kind of study, its key, its text), ``results`` one row
an item with its number, its values, the seconds that it took and the worker, and ``crashed`` the items at
which a worker died. An item has one row, whatever was computed twice; a process killed at any moment leaves
all rows that were written.
"""

import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any, Final, Self, final

from ftqp.core.errors import FtqpError, InputError

FILE_NAME = "results.sqlite"
LOCK_NAME = "writer.lock"
FORMAT = 1
"""Version of the file's layout."""
REMEDY = "name another folder by --out"
"""What to do where a folder cannot be used."""
EVERY = 2**63 - 1
"""No item has a number as large as this."""
PATIENCE = 10.0
"""A reader of another process may keep the writer waiting so long [s]."""
TAKEN: Final = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
_CLEAR = "DELETE FROM crashed WHERE item = ?"

Columns = Mapping[str, str]
"""Names of the values of an item with their types: REAL, INTEGER or TEXT."""


@final
class ResultsFile:
    """A study's results, open for one writer, in a folder that is made if need be.

    ``kind`` and ``key`` distinguish this study from others, ``about`` is more about it by key, anything
    that JSON holds, ``onward`` what goes on later.

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
        onward: str | None = None,
    ) -> None:
        self.onward = onward or f"the same command with --out {folder}"
        self.path = folder / FILE_NAME
        self._columns = dict(columns)
        facts = {"format": FORMAT, "kind": kind, "key": key} | dict(about or {})
        with _readable(self.path), ExitStack() as opened:
            folder.mkdir(parents=True, exist_ok=True)
            opened.enter_context(closing(locked(folder)))
            connection = sqlite3.connect(self.path, isolation_level="IMMEDIATE", timeout=PATIENCE)
            self._connection = opened.enter_context(closing(connection))
            if self.path.stat().st_size == 0:
                self._make_tables(facts)
            else:
                self._refuse_other_studies(facts)
            self._opened = opened.pop_all()

    def done(self) -> set[int]:
        """The numbers of the items that have a row."""
        return {item for (item,) in self._read("SELECT item FROM results")}

    def count(self, below: int = EVERY) -> int:
        """How many items with numbers below this one have a row."""
        return int(self._read("SELECT count(*) FROM results WHERE item < ?", below)[0][0])

    def write(self, items: Sequence[int], rows: Sequence[Sequence[Any]], seconds: float, worker: str) -> None:
        """Put the rows of a chunk on file, all or none, with its time [s]; an item keeps the row it has."""
        share = seconds / max(len(items), 1)
        marks = ", ".join("?" * (len(self._columns) + 3))
        values = [(item, *row, share, worker) for item, row in zip(items, rows, strict=True)]
        self._commit(
            {f"INSERT OR IGNORE INTO results VALUES ({marks})": values, _CLEAR: [(item,) for item in items]}
        )

    def crash(self, items: Sequence[int], why: str) -> None:
        """Note items at which a process died, or may die; whoever continues the study tries them again."""
        self._commit({"INSERT OR REPLACE INTO crashed VALUES (?, ?)": [(item, why) for item in items]})

    def clear(self, items: Sequence[int]) -> None:
        """Forget that a process died, or might have died, at items."""
        self._commit({_CLEAR: [(item,) for item in items]})

    def crashed(self) -> dict[int, str]:
        """The items at which a worker died, or a process that computed them itself, with the reason."""
        return dict(self._read("SELECT item, reason FROM crashed ORDER BY item"))

    def table(self) -> list[tuple[Any, ...]]:
        """All rows by item: its number, then its values."""
        names = ", ".join(f'"{name}"' for name in ("item", *self._columns))
        return self._read(f"SELECT {names} FROM results ORDER BY item")

    def seconds(self, below: int = EVERY) -> float:
        """What all items with numbers below this one took together [s]."""
        asked = "SELECT coalesce(sum(seconds), 0.0) FROM results WHERE item < ?"
        return float(self._read(asked, below)[0][0])

    def _read(self, asked: str, *values: Any) -> list[tuple[Any, ...]]:
        """What the file answers."""
        with _readable(self.path):
            return self._connection.execute(asked, values).fetchall()

    def _commit(self, changes: Mapping[str, Iterable[tuple[Any, ...]]]) -> None:
        """Everything or nothing: statements with the values for which each is run."""
        try:
            with self._connection:
                for statement, values in changes.items():
                    self._connection.executemany(statement, values)
        except sqlite3.Error as error:
            raise FtqpError(
                f"results file {self.path} cannot be written: {error}; what was written before is "
                f"kept, and {self.onward} goes on from there"
            ) from error

    def _make_tables(self, facts: Mapping[str, Any]) -> None:
        """Make the tables, all or none."""
        listed = ", ".join(f'"{name}" {kind}' for name, kind in self._columns.items())
        with self._connection as made:
            made.execute("BEGIN")
            made.execute("CREATE TABLE about (key TEXT PRIMARY KEY, value TEXT NOT NULL)")
            made.execute("CREATE TABLE crashed (item INTEGER PRIMARY KEY, reason TEXT NOT NULL)")
            made.execute(
                f"CREATE TABLE results (item INTEGER PRIMARY KEY, {listed}, seconds REAL, worker TEXT)"
            )
            encoded = [(key, json.dumps(value, allow_nan=False)) for key, value in facts.items()]
            made.executemany("INSERT INTO about VALUES (?, ?)", encoded)

    def _refuse_other_studies(self, wanted: Mapping[str, Any]) -> None:
        """Refuse a file that is not of this very study."""
        path, facts = self.path, facts_of(self._connection, self.path)
        if facts.get("kind") != wanted["kind"]:
            raise InputError(
                f"{path} holds results of a study of kind {facts.get('kind')!r:.40}, this one is of kind "
                f"{wanted['kind']!r}; {REMEDY}"
            )
        if facts.get("ftqp") != wanted.get("ftqp"):
            raise InputError(
                f"{path} was made by ftqp {facts.get('ftqp')!s:.40}, this is {wanted.get('ftqp')}, and their "
                f"results are not mixed; {REMEDY}, or continue it with that version"
            )
        names = [name for _, name, *_ in self._connection.execute("PRAGMA table_info(results)")]
        if facts.get("key") != wanted["key"] or names[1:-2] != list(self._columns):
            raise InputError(f"{path} holds results of another study{_difference(facts, wanted)}; {REMEDY}")

    def close(self) -> None:
        """Let go of the file."""
        self._opened.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def facts_of(connection: sqlite3.Connection, path: Path) -> dict[str, Any]:
    """What a file says about its study, by key."""
    try:
        facts = {key: json.loads(value) for key, value in connection.execute("SELECT * FROM about")}
        version = int(facts["format"])
    except (ValueError, TypeError, KeyError, sqlite3.OperationalError) as error:
        raise InputError(f"{path} is not a results file of ftqp, or is damaged: {error!s:.100}") from error
    if version > FORMAT:
        raise InputError(
            f"{path} has format {version}, this ftqp reads up to {FORMAT}; a newer ftqp made it and can go on"
        )
    return facts


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


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """Says in a sentence why a file cannot be used."""
    try:
        yield
    except (sqlite3.Error, OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be used as a results file: {error}; {REMEDY}") from error


def locked(folder: Path) -> sqlite3.Connection:
    """The lock of a folder's only writer; the system lets it go when the process ends, however it does."""
    lock = sqlite3.connect(folder / LOCK_NAME, isolation_level=None, timeout=0.0)
    try:
        lock.execute("BEGIN EXCLUSIVE")
    except sqlite3.Error as error:
        lock.close()
        if error.sqlite_errorcode not in TAKEN:
            raise
        raise InputError(
            f"another process writes to {folder}; wait until it has ended, or {REMEDY}"
        ) from error
    return lock
