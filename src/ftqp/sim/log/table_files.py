"""A log as a table that other programs read: CSV, NPZ and MAT, streamed, whole or not at all."""

import csv
import json
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.sim.log.log_rows import LogRows
from ftqp.sim.log.whole_files import whole_file

Told = Callable[[float], None]
"""Told the share of the work that is done."""
ABOUT = "about"
"""The array of an NPZ file that holds what the log says of its run and its signals, as JSON."""
LARGEST_VARIABLE = 2**31 - 1
"""Bytes that a variable of a MAT file of version 5 has at most."""
AT_ONCE = 1 << 20
"""Numbers of a column that are held at once."""


def silent(share: float) -> None:
    """Tells nobody."""


def write_csv(rows: LogRows, path: str | Path, told: Told = silent) -> None:
    """All signals in a new CSV file: names in the first line, then a line a tick, with every digit.

    Raises:
        InputError: The file exists already or cannot be made, or the log is damaged.
    """
    with whole_file(path) as part, part.open("x", newline="", encoding="utf-8") as file:
        whole, done = rows.whole(), 0
        writer = csv.writer(file)
        writer.writerow([column.name for column in rows.columns])
        for block in rows.blocks():
            columns = (
                block[:, k].astype(np.int64) if exact else block[:, k] for k, exact in enumerate(whole)
            )
            writer.writerows(zip(*(column.tolist() for column in columns), strict=True))
            done += len(block)
            told(done / rows.count)


def write_npz(rows: LogRows, path: str | Path, told: Told = silent) -> None:
    """All signals in a new NPZ file, an array a group: ``q`` is (K, nv), ``t`` is (K,).

    ``about`` is a JSON text with the names, units and sentences of the signals of each group, and with the
    log's metadata.

    Raises:
        InputError: The file exists already or cannot be made, or the log is damaged.
    """
    groups = _groups(rows)
    about = json.dumps(_about(rows, groups))
    with whole_file(path) as part, _columns_of(rows, part.parent, told) as columns:
        whole = rows.whole()
        with zipfile.ZipFile(part, "x", zipfile.ZIP_DEFLATED, allowZip64=True) as archive:
            for done, (name, places) in enumerate(groups.items()):
                kind = np.dtype("<i8" if all(whole[k] for k in places) else "<f8")
                shape = (rows.count,) if _is_single(rows, places) else (rows.count, len(places))
                with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                    header = {"descr": kind.str, "fortran_order": True, "shape": shape}
                    np.lib.format.write_array_header_2_0(file, header)
                    for place in places:
                        for piece in columns(place):
                            file.write(piece.astype(kind).tobytes())
                told(0.5 + 0.5 * done / len(groups))
            with archive.open(f"{ABOUT}.npy", "w") as file:
                np.lib.format.write_array(file, np.array(about))


def write_mat(rows: LogRows, path: str | Path, told: Told = silent) -> None:
    """All signals in a new MAT file of version 5, a variable a group: ``q`` is (K, nv), ``t`` is (K, 1).

    ``signals`` and ``units`` are structs with a cell array of names for each group, and ``metadata`` is the
    log's as a JSON text. One group at a time is held in memory.
    """
    from scipy.io import savemat  # slow to load

    groups = _groups(rows)
    largest = 8 * rows.count * max(len(places) for places in groups.values())
    if largest > LARGEST_VARIABLE:
        raise InputError(
            f"{rows.title} has groups of {largest / 1e9:.1f} GB, a MAT file takes 2.1 GB; write NPZ or CSV"
        )
    names = {group: _cells([rows.columns[k].name for k in places]) for group, places in groups.items()}
    units = {group: _cells([rows.columns[k].unit for k in places]) for group, places in groups.items()}
    about = {"signals": names, "units": units, "metadata": json.dumps(dict(rows.metadata))}
    with whole_file(path) as part, _columns_of(rows, part.parent, told) as columns:
        whole = rows.whole()
        with part.open("xb") as opened:
            file: Any = opened  # versions of scipy disagree on what a file may be
            for done, (name, places) in enumerate(groups.items()):
                kind = np.int64 if all(whole[k] for k in places) else np.float64
                values: NDArray[Any] = np.empty((rows.count, len(places)), kind, order="F")
                for k, place in enumerate(places):
                    at = 0
                    for piece in columns(place):
                        values[at : at + len(piece), k] = piece
                        at += len(piece)
                savemat(file, {name: values}, appendmat=False)
                told(0.5 + 0.5 * done / len(groups))
            savemat(file, about, appendmat=False, long_field_names=True)


def _groups(rows: LogRows) -> dict[str, list[int]]:
    groups = rows.groups()
    for name in (ABOUT, "signals", "units", "metadata"):
        if name in groups:
            raise InputError(f"{rows.title} has a signal {name!r}, which ftqp does not write; rename it")
    return groups


def _is_single(rows: LogRows, places: list[int]) -> bool:
    """Whether a group is one signal whose name has no dot."""
    return len(places) == 1 and "." not in rows.columns[places[0]].name


def _about(rows: LogRows, groups: dict[str, list[int]]) -> dict[str, Any]:
    return {
        "signals": {
            group: [
                {
                    "name": rows.columns[k].name,
                    "unit": rows.columns[k].unit,
                    "is": rows.columns[k].description,
                }
                for k in places
            ]
            for group, places in groups.items()
        },
        "metadata": dict(rows.metadata),
    }


def _cells(words: list[str]) -> NDArray[np.object_]:
    """A cell array of texts."""
    result = np.empty(len(words), dtype=object)
    result[:] = words
    return result


@contextmanager
def _columns_of(rows: LogRows, folder: Path, told: Told) -> Iterator[Callable[[int], Iterator[FloatArray]]]:
    """A function that reads a column of a log in pieces, from a nameless file in ``folder``.

    Half of ``told`` is for the writing of that file, in which columns follow each other.
    """
    with TemporaryFile(dir=folder) as file:
        done = 0
        for block in rows.blocks():
            for place, column in enumerate(block.T):
                file.seek(8 * (place * rows.count + done))
                file.write(column.tobytes())
            done += len(block)
            told(0.5 * done / rows.count)
        yield lambda place: _pieces(file, place, rows.count)


def _pieces(file: IO[bytes], place: int, count: int) -> Iterator[FloatArray]:
    for first in range(0, count, AT_ONCE):
        file.seek(8 * (place * count + first))
        yield np.frombuffer(file.read(8 * min(AT_ONCE, count - first)), dtype=np.float64)
