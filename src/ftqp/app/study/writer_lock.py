"""The lock of a folder's only writer: the system lets it go when the process ends, however it does."""

import sqlite3
from pathlib import Path

from ftqp.app.study.disk_trouble import BUSY, CURE, CURED, code, reason
from ftqp.core.errors import InputError
from ftqp.sim.log.side_files import strange_side_file

LOCK_NAME = "writer.lock"


def locked(folder: Path, remedy: str) -> sqlite3.Connection:
    """The lock, held until the connection is closed.

    Args:
        folder: The folder, which exists.
        remedy: What a person can do where it cannot be used, for messages.

    Raises:
        InputError: Another process holds the lock, something else has its name, or it cannot be written.
    """
    file = folder / LOCK_NAME
    if file.is_symlink() or (file.exists() and not file.is_file()):
        raise _strange(file, "it is no file of its own")
    if side := strange_side_file(file):
        raise _strange(side, "it is no regular file")
    try:
        lock = sqlite3.connect(file, isolation_level=None, timeout=0.0)
    except sqlite3.Error as error:
        raise _refused(file, error, remedy) from error
    try:
        lock.execute("BEGIN EXCLUSIVE")
    except sqlite3.Error as error:
        lock.close()
        raise _refused(file, error, remedy) from error
    return lock


def _refused(file: Path, error: sqlite3.Error, remedy: str) -> InputError:
    """Why there is no lock."""
    if code(error) in BUSY:
        return InputError(f"another process writes to {file.parent}; wait until it has ended, or {remedy}")
    if code(error) in CURED:
        return InputError(f"folder {file.parent} cannot be written: {reason(error)}; {CURE}, or {remedy}")
    return _strange(file, reason(error))


def _strange(file: Path, why: str) -> InputError:
    return InputError(
        f"{file} is not the lock that ftqp keeps there: {why}; delete it, and the same command goes on"
    )
