"""The files that SQLite opens beside a database of its own accord: its journal, its log ahead, its index."""

from pathlib import Path

SIDES = ("-journal", "-wal", "-shm")
"""What SQLite adds to a database's name."""


def strange_side_file(file: Path) -> Path | None:
    """A file beside a database that is no regular one, for example a pipe, at which SQLite waits forever."""
    whole = file.resolve()
    sides = (whole.with_name(whole.name + side) for side in SIDES)
    return next((side for side in sides if side.exists() and not side.is_file()), None)
