"""What SQLite means when it cannot read or write a file, in words."""

import sqlite3
from typing import Final

MEANINGS: Final = {
    sqlite3.SQLITE_IOERR: "the disk is full or fails",
    sqlite3.SQLITE_CORRUPT: "the file is damaged",
    sqlite3.SQLITE_CANTOPEN: "the disk is full, or the folder is read-only",
    sqlite3.SQLITE_READONLY: "the file or its folder is read-only",
    sqlite3.SQLITE_FULL: "",
}
"""What SQLite's errors mean by their code; the last one says so itself."""
CURED: Final = (sqlite3.SQLITE_IOERR, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY, sqlite3.SQLITE_FULL)
"""Errors that are over, and nothing is lost, once the disk can be written again."""
CURE: Final = "free the disk, or make it writable, and nothing is lost"
"""What a person can do about those."""
BUSY: Final = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
"""Errors that say that another process is at work."""


def code(error: Exception) -> int:
    """SQLite's primary code of an error; 0 where it has none.

    Args:
        error: Any.
    """
    return int(getattr(error, "sqlite_errorcode", 0) or 0) & 0xFF


def reason(error: Exception | str) -> str:
    """Why a file cannot be used.

    Args:
        error: What came of it, or the reason itself.
    """
    said = str(getattr(error, "strerror", None) or error)
    meaning = MEANINGS.get(code(error), "") if isinstance(error, Exception) else ""
    return f"{said} ({meaning})" if meaning else said
