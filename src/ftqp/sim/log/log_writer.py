"""Writes the log of a run: a table that ``numpy.load`` reads, and beside it what it means, as JSON.

``log.npy`` has one row a tick and one float64 a signal; ``log.json`` holds ``columns``, in a row's order,
and ``metadata`` (scenario, robot, limits, faults, versions, state of the run):

    table, about = numpy.load("log.npy", mmap_mode="r"), json.load(open("log.json"))
    pandas.DataFrame(table, columns=[column["name"] for column in about["columns"]])

Rows are put into their places, then the header says how many there are: a process that is killed at any
moment leaves every row that was written. A long log may be cut: its newest part is ``log.npy``, those before
are ``log-00001.npy`` and so on, each a log by itself, whose ``first_tick`` says at which tick it begins.
"""

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from io import BytesIO
from pathlib import Path
from re import fullmatch
from typing import Any, Final, Self, final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import FtqpError, InputError
from ftqp.core.whole_file import whole_file
from ftqp.sim.log.log_rows import RowSink
from ftqp.sim.log.signals import Column

FILE_NAME: Final = "log.npy"
"""The log of a run, or the newest part of it."""
FORMAT: Final = 3
"""Version of the log's layout."""
FIRST_TICK: Final = "first_tick"
"""The entry of a part's metadata that says at which tick of the run it begins."""


def beside(file: Path) -> Path:
    """Where it is said what a table means."""
    return file.with_suffix(".json")


@final
class LogWriter(RowSink):
    """A new log; every write is on file when it returns."""

    def __init__(self, path: str | Path, columns: Sequence[Column], metadata: Mapping[str, Any]) -> None:
        self.path = Path(path)
        named = [asdict(column) for column in columns]
        self._about: dict[str, Any] = {"format": FORMAT, "columns": named, "metadata": dict(metadata)}
        try:
            self._file = self.path.open("xb", buffering=0)
        except FileExistsError as error:
            raise InputError(
                f"log file {self.path} exists already; choose another folder, logs are never overwritten"
            ) from error
        except OSError as error:
            raise InputError(f"log file {self.path} cannot be made: {error}") from error
        try:
            self._put(0, self._header(0))
            self.annotate({})
        except BaseException:
            self.close()
            self.path.unlink(missing_ok=True)
            raise

    def write(self, first: int, rows: FloatArray) -> None:
        """Put rows on file. Interrupted at any point, it can be called again."""
        header = self._header(first + len(rows))
        self._put(len(header) + rows.shape[1] * first * 8, np.ascontiguousarray(rows, dtype="<f8").tobytes())
        self._put(0, header)

    def annotate(self, metadata: Mapping[str, Any]) -> None:
        self._about["metadata"] |= metadata
        file = beside(self.path)
        try:
            with whole_file(file) as part:
                part.write_text(json.dumps(self._about, allow_nan=False), encoding="utf-8")
        except OSError as error:
            raise FtqpError(f"log file {file} cannot be written: {error}") from error

    def _header(self, count: int) -> bytes:
        """That of a NPY file of so many rows; numpy makes it as long whatever their number."""
        made = BytesIO()
        shape = (count, len(self._about["columns"]))
        np.lib.format.write_array_header_1_0(made, {"descr": "<f8", "fortran_order": False, "shape": shape})
        return made.getvalue()

    def _put(self, at: int, data: bytes) -> None:
        try:
            self._file.seek(at)
            while data:
                data = data[self._file.write(data) :]
        except OSError as error:
            raise FtqpError(f"log file {self.path} cannot be written: {error}") from error

    def close(self) -> None:
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LogParts:
    """How a long log is cut into files."""

    path: Path  # The newest part, a new file; those before lie beside it
    rows: int  # A part has so many at least, >= 1; a new one begins when rows are next put on file
    # So many parts are kept, the newest included, >= 1, and older ones are deleted; None keeps all
    keep: int | None = None

    def __post_init__(self) -> None:
        if self.rows < 1 or (self.keep is not None and self.keep < 1):
            raise InputError(
                f"a log has parts of {self.rows} rows, of which {self.keep} are kept; expected 1 or more"
            )


@final
class PartedLog(RowSink):
    """Writes a log in parts; what was written stays readable, whatever ends the process."""

    def __init__(self, parts: LogParts, columns: Sequence[Column], metadata: Mapping[str, Any]) -> None:
        self._parts, self._columns, self._metadata = parts, tuple(columns), dict(metadata)
        self._begin, self._number = 0, 0
        self._writer = self._made(0)

    def _made(self, first: int) -> LogWriter:
        return LogWriter(self._parts.path, self._columns, self._metadata | {FIRST_TICK: first})

    def write(self, first: int, rows: FloatArray) -> None:
        """Put rows on file, (K, columns). Interrupted at any point, it can be called again."""
        if first - self._begin >= self._parts.rows:
            self._turn(first)
        self._writer.write(first - self._begin, rows)

    def _turn(self, first: int) -> None:
        """Begin a new part, delete the oldest where there are too many. Interrupted, it can be repeated."""
        path, number, keep = self._parts.path, self._number + 1, self._parts.keep
        try:
            if not part_file(path, number).exists():
                self._writer.annotate({"state": "continued"})
                self._writer.close()
            for file in (beside(path), path):
                if part_file(file, number).exists():
                    file.unlink(missing_ok=True)  # of a part that was begun when this was interrupted
                else:
                    file.rename(part_file(file, number))
            for at in range(number - keep + 1, 0, -1) if keep is not None else ():
                gone = part_file(path, at)
                if not gone.exists():
                    break
                beside(gone).unlink(missing_ok=True)
                gone.unlink()
            self._writer = self._made(first)
        except (OSError, FtqpError) as error:
            raise FtqpError(f"part {number + 1} of the log {path} cannot be begun: {error}") from error
        self._begin, self._number = first, number

    def annotate(self, metadata: Mapping[str, Any]) -> None:
        self._writer.annotate(metadata)

    def close(self) -> None:
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
    return [file for _, file in sorted(older)] + ([newest] if os.path.isfile(newest) else [])
