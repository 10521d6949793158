"""A long log in several files: the newest part is ``log.sqlite``, those before are ``log-00001.sqlite`` ...

Every part is a log by itself; ``first_tick`` of its metadata says at which tick of the run it begins.
"""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from re import fullmatch
from typing import Any, final

from ftqp.core.checks import FloatArray
from ftqp.core.errors import FtqpError, InputError
from ftqp.sim.log.log_rows import LogRows
from ftqp.sim.log.log_writer import LogWriter
from ftqp.sim.log.row_sink import RowSink
from ftqp.sim.log.signals import Column

FILE_NAME = "log.sqlite"
"""The log of a run, or the newest part of it."""
FIRST_TICK = "first_tick"
"""The entry of a part's metadata that says at which tick of the run it begins."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LogParts:
    """How a long log is cut into files.

    Attributes:
        path: The newest part, a new file; those before lie beside it.
        rows: A part has so many at least, >= 1; a new one begins when rows are next put on file.
        keep: So many parts are kept, the newest included, >= 1, and older ones are deleted; None keeps all.
    """

    path: Path
    rows: int
    keep: int | None = None

    def __post_init__(self) -> None:
        if self.rows < 1 or (self.keep is not None and self.keep < 1):
            raise InputError(
                f"a log has parts of {self.rows} rows, of which {self.keep} are kept; expected 1 or more"
            )


@final
class PartedLog(RowSink):
    """Writes a log in parts; what has been written stays readable at any moment, whatever ends the process.

    Raises:
        InputError: The first file exists already or cannot be made.
    """

    def __init__(self, parts: LogParts, columns: Sequence[Column], metadata: Mapping[str, Any]) -> None:
        self._parts, self._columns, self._metadata = parts, tuple(columns), dict(metadata)
        self._begin, self._number = 0, 0
        self._writer: LogWriter | None = self._made(0)

    def _made(self, first: int) -> LogWriter:
        return LogWriter(self._parts.path, self._columns, self._metadata | {FIRST_TICK: first})

    def write(self, first: int, rows: FloatArray) -> None:
        """Put rows on file, (K, columns). Interrupted at any point, it can be called again.

        Raises:
            FtqpError: They cannot be written, for example because the disk is full.
        """
        if first - self._begin >= self._parts.rows:
            self._turn(first)
        assert self._writer is not None
        self._writer.write(first - self._begin, rows)

    def _turn(self, first: int) -> None:
        """Begin a new part, delete the oldest where there are too many. Interrupted, it can be repeated."""
        path, number = self._parts.path, self._number + 1
        if self._writer is not None:
            self._writer.annotate({"state": "continued"})
            self._writer.close()
            self._writer = None
        try:
            old = part_file(path, number)
            if old.exists():
                path.unlink(missing_ok=True)  # a part that was begun when this was interrupted
            else:
                _on_disk(path)
                path.rename(old)
            if self._parts.keep is not None:  # first: they may be what fills the disk
                for at in range(number - self._parts.keep + 1, 0, -1):
                    gone = part_file(path, at)
                    if not gone.exists():
                        break
                    gone.unlink()
            self._writer = self._made(first)
        except (OSError, InputError) as error:
            raise FtqpError(f"part {number + 1} of the log {path} cannot be begun: {error}") from error
        self._begin, self._number = first, number

    def annotate(self, metadata: Mapping[str, Any]) -> None:
        """Add or replace metadata of the newest part.

        Raises:
            FtqpError: The file cannot be written.
        """
        if self._writer is not None:
            self._writer.annotate(metadata)

    def close(self) -> None:
        """Let go of the file."""
        if self._writer is not None:
            self._writer.close()


def part_file(path: Path, number: int) -> Path:
    """The file of an older part."""
    return path.with_name(f"{path.stem}-{number:05}{path.suffix}")


def log_files(folder: Path) -> list[Path]:
    """The files of the log of a run, in the order of time; none where there is none."""
    newest = folder / FILE_NAME
    older = [
        (int(found[1]), file)
        for file in folder.glob(f"{newest.stem}-*{newest.suffix}")
        if (found := fullmatch(rf"{newest.stem}-(\d{{5,9}})\{newest.suffix}", file.name))
    ]
    return [file for _, file in sorted(older)] + ([newest] if newest.is_file() else [])


def joined(
    folder: Path, files: Sequence[Path], opened: Callable[[Path], AbstractContextManager[LogRows]]
) -> LogRows:
    """Parts of one log as one; the metadata are those of the newest."""
    counts: list[int] = []
    columns: tuple[Column, ...] = ()
    metadata: Mapping[str, Any] = {}
    begin = 0
    for file in files:
        with opened(file) as rows:
            first = rows.metadata.get(FIRST_TICK)
            if counts and (rows.columns != columns or first != begin):
                raise InputError(
                    f"{file} does not go on where the part before it ends, at tick {begin} of its run; load "
                    "the parts one by one"
                )
            begin = (first if isinstance(first, int) else 0) + rows.count
            columns, metadata = rows.columns, rows.metadata
            counts.append(rows.count)

    def read(first: int) -> Iterator[FloatArray]:
        for file, count in zip(files, counts, strict=True):
            if first < count:
                with opened(file) as rows:
                    yield from rows.blocks(first)
            first = max(first - count, 0)

    return LogRows(path=folder, columns=columns, metadata=metadata, count=sum(counts), read=read)


def _on_disk(path: Path) -> None:
    """Wait until a finished part has left the caches of the system, so that it outlives a loss of power."""
    handle = os.open(path, os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
