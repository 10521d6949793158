"""Reads the log of a run, or a portion of it, from its table and what is said beside it."""

import json
import os
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NoReturn

import numpy as np

from ftqp.core.checks import FloatArray, instance, non_negative
from ftqp.core.errors import InputError, unknown
from ftqp.kernel.layout.thresholds import TIME_SLACK
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.log_rows import LogRows, RunFacts
from ftqp.sim.log.log_writer import FILE_NAME, FIRST_TICK, FORMAT, beside, log_files
from ftqp.sim.log.raw_rows import BLOCK
from ftqp.sim.log.signals import Column

OLD, LAST_OLD = ".sqlite", "e64a102a"
"""What logs were called before, and the last commit that reads them."""


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
        path: The file, or the folder of a run: its ``log.npy``, with the parts before it if there are any.
        begin: No row before this time is loaded [s]; all from the first on without it.
        end: No row after this time is loaded [s]; all to the last without it.
        signals: Names of what is loaded, single signals or groups such as ``"q"``; all without it.

    Raises:
        InputError: No such file, not a log of ftqp, an unknown signal, or more than fits into memory.
    """
    rows = open_log(path)
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
    (place,) = _places(rows, ["t"])

    def first_at(limit: float) -> int:
        return bisect_left(range(rows.count), limit, key=lambda k: float(next(rows.blocks(k))[0, place]))

    low = 0 if begin is None else first_at(non_negative("begin", begin, "s") - TIME_SLACK)
    high = rows.count if end is None else first_at(non_negative("end", end, "s") + TIME_SLACK)
    return low, max(low, high)


def physical_memory() -> float:
    """Bytes of memory that this machine has; infinite where it does not say."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return float("inf")


def open_log(path: str | Path) -> LogRows:
    """The rows of a log, which are read block after block."""
    instance("path", path, str | Path, "the path of a log or of the folder of a run")
    given = Path(path)
    folder = os.path.isdir(given)  # a name that is too long is none
    files = log_files(given) if folder else [given]
    if not files or not os.path.isfile(files[0]):
        file = given / FILE_NAME if folder else given
        if folder and os.path.isfile(file.with_suffix(OLD)):
            _refuse_old(file.with_suffix(OLD))
        raise InputError(f"log {file} does not exist; expected a {FILE_NAME} or the folder of a run")
    return _joined(files[0] if len(files) == 1 else given, files)


def _refuse_old(file: Path) -> NoReturn:
    raise InputError(
        f"{file} is a log of an ftqp up to November 2026, in SQLite; this one reads {FILE_NAME}. Commit "
        f"{LAST_OLD} is the last that reads it: `ftqp export` there writes it as NPZ, CSV or MAT"
    )


def _joined(path: Path, files: Sequence[Path]) -> LogRows:
    """Parts of one log as one; the metadata are those of the newest."""
    parts = [_part(file) for file in files]
    at = parts[0][0].get(FIRST_TICK, 0)
    for file, (metadata, columns, table) in zip(files, parts, strict=True):
        if columns != parts[0][1] or metadata.get(FIRST_TICK, 0) != at:
            raise InputError(
                f"{file} does not go on where the part before it ends, at tick {at} of its run; load the "
                "parts one by one"
            )
        at += len(table)

    def read(first: int) -> Iterator[FloatArray]:
        for _, _, table in parts:
            for k in range(first, len(table), BLOCK):
                yield table[k : k + BLOCK]
            first = max(first - len(table), 0)

    count = sum(len(table) for _, _, table in parts)
    return LogRows(path=path, columns=parts[0][1], metadata=parts[-1][0], count=count, read=read)


def _part(file: Path) -> tuple[RunFacts, tuple[Column, ...], FloatArray]:
    """What a file holds."""
    if file.suffix == OLD:
        _refuse_old(file)
    try:
        about = json.loads(beside(file).read_text(encoding="utf-8"))
        if about["format"] != FORMAT:
            raise InputError(
                f"{file} has format {about['format']!r:.20}, this ftqp reads {FORMAT}; read it with the "
                "version that wrote it, which its .json names, and export it there: "
                "`ftqp export RUN --format npz`"
            )
        columns = tuple(Column(**column) for column in about["columns"])
        table = np.load(file, mmap_mode="r")
        if table.shape[1:] != (len(columns),) or table.dtype != "<f8":
            raise ValueError("another table")
        return RunFacts(about["metadata"]), columns, table
    except InputError:
        raise
    except Exception as error:  # numpy has many for a header that is damaged
        why = f": {error.strerror}" if isinstance(error, OSError) else ""
        raise InputError(f"{file} is not a log of ftqp, or is damaged, or {beside(file)} is{why}") from error
