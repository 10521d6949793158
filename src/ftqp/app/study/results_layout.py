"""The layout of a results file: its tables, what it says of its study, and what is refused."""

import json
import sqlite3
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from ftqp.core.errors import InputError

FORMAT = 1
"""Version of the file's layout."""
KINDS = {"REAL", "INTEGER", "TEXT"}
ABOUT = "CREATE TABLE about (key TEXT PRIMARY KEY, value TEXT NOT NULL)"
CRASHED = "CREATE TABLE crashed (item INTEGER PRIMARY KEY, reason TEXT NOT NULL)"
RESULTS = "CREATE TABLE results (item INTEGER PRIMARY KEY,"

Columns = Mapping[str, str]
"""Names of the values of an item with their types: REAL, INTEGER or TEXT."""

MEANINGS: Final = {
    sqlite3.SQLITE_IOERR: "the disk is full or fails",
    sqlite3.SQLITE_CORRUPT: "the file is damaged",
    sqlite3.SQLITE_CANTOPEN: "the disk is full, or the folder is read-only",
    sqlite3.SQLITE_READONLY: "the file or its folder is read-only",
    sqlite3.SQLITE_FULL: "",
}
"""What SQLite's errors mean by their code; the last one says so itself."""
CURED: Final = frozenset(MEANINGS) - {sqlite3.SQLITE_CORRUPT}
"""Errors that are over, and nothing is lost, once the disk can be written again."""
CURE: Final = "free the disk, or make it writable, and nothing is lost"
"""What a person can do about those."""


def code(error: Exception) -> int:
    """SQLite's primary code of an error; 0 where it has none."""
    return int(getattr(error, "sqlite_errorcode", 0) or 0) & 0xFF


def reason(error: Exception) -> str:
    """Why a file cannot be used."""
    said = str(getattr(error, "strerror", None) or error)
    meaning = MEANINGS.get(code(error))
    return f"{said} ({meaning})" if meaning else said


def make_tables(connection: sqlite3.Connection, facts: Mapping[str, Any], columns: Columns) -> None:
    """Make the tables, all or none."""
    encoded = [(key, json.dumps(value, allow_nan=False)) for key, value in facts.items()]
    with connection:
        for statement in ("BEGIN", ABOUT, CRASHED, _results_table(columns)):
            connection.execute(statement)
        connection.executemany("INSERT INTO about VALUES (?, ?)", encoded)


def facts_of(connection: sqlite3.Connection, path: Path) -> dict[str, Any]:
    """What a file says about its study, by key."""
    made = _made(connection)
    for name, begun in (("results", RESULTS), ("about", ABOUT), ("crashed", CRASHED)):
        if not str(made.get(name)).startswith(begun):
            raise InputError(
                f"{path} is not a results file of ftqp: it has no table {name} as such a file has it"
            )
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


def _made(connection: sqlite3.Connection) -> dict[str, str]:
    """The statement that made each table."""
    return dict(connection.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table'"))


def refuse_other_studies(
    connection: sqlite3.Connection,
    path: Path,
    wanted: Mapping[str, Any],
    columns: Columns,
    remedy: str,
) -> None:
    """Refuse a file that is not of this very study."""
    facts = facts_of(connection, path)
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
    if facts.get("key") != wanted["key"] or _made(connection).get("results") != _results_table(columns):
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


def _results_table(columns: Mapping[str, str]) -> str:
    """The statement that makes the table of results."""
    for name, kind in columns.items():
        if kind not in KINDS:
            raise ValueError(f"column {name} has type {kind!r}, expected one of {sorted(KINDS)}")
    listed = ", ".join(f"{quoted(name)} {kind}" for name, kind in columns.items())
    return f"{RESULTS} {listed}, seconds REAL, worker TEXT)"


def quoted(name: str) -> str:
    """A column's name as SQL wants it."""
    return '"' + name.replace('"', '""') + '"'
