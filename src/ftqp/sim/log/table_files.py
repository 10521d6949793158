"""A log as a table that other programs read: CSV, NPZ and MAT, whole or not at all."""

import csv
import json
import os
import shutil
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.core.errors import InputError
from ftqp.core.whole_file import free_path, whole_file
from ftqp.sim.log.log_rows import LogRows


@contextmanager
def new_file(path: str | Path) -> Iterator[Path]:
    """A new file: the body writes the path that it gets, and the file gets its name when it is complete."""
    file = free_path(path, "file")
    try:
        with whole_file(file) as part:
            yield part
    except OSError as error:
        raise InputError(f"file {file} cannot be written: {error.strerror or error}") from error


@contextmanager
def whole_folder(path: str | Path) -> Iterator[Path]:
    """A new folder: the body makes the path that it gets, of the same name, which is moved when complete."""
    folder = free_path(path, "folder")
    part = folder.with_name(f".{folder.name}.{os.getpid()}.part")
    try:
        part.mkdir()
        yield part / folder.name
        (part / folder.name).rename(free_path(folder, "folder"))
    except OSError as error:
        raise InputError(f"folder {folder} cannot be written: {error.strerror or error}") from error
    finally:
        shutil.rmtree(part, ignore_errors=True)


Told = Callable[[float], None]
"""Told the share of the work that is done."""
ABOUT = "about"
"""The array of an NPZ file that holds what the log says of its run and its signals, as JSON."""
LARGEST_VARIABLE = 2**31 - 1
"""Bytes that a variable of a MAT file of version 5 has at most."""


def silent(share: float) -> None:
    """Tells nobody."""


def write_csv(rows: LogRows, path: str | Path, notify: Told = silent) -> None:
    """All signals in a new CSV file: names in the first line, then a line a tick, with every digit."""
    with new_file(path) as part, part.open("x", newline="", encoding="utf-8") as file:
        whole, done = rows.whole(), 0
        writer = csv.writer(file)
        writer.writerow([column.name for column in rows.columns])
        for block in rows.blocks():
            columns = (
                block[:, k].astype(np.int64) if exact else block[:, k] for k, exact in enumerate(whole)
            )
            writer.writerows(zip(*(column.tolist() for column in columns), strict=True))
            done += len(block)
            notify(done / rows.count)


def write_npz(rows: LogRows, path: str | Path, notify: Told = silent) -> None:
    """All signals in a new NPZ file, an array a group: ``q`` is (K, nv), ``t`` is (K,).

    ``about`` is a JSON text of each group's names, units and sentences, and of the log's metadata.
    """
    groups = rows.groups()
    with new_file(path) as part, zipfile.ZipFile(part, "x", zipfile.ZIP_DEFLATED) as archive:
        whole = rows.whole()
        for done, (name, places) in enumerate(groups.items(), 1):
            kind = np.dtype("<i8" if all(whole[k] for k in places) else "<f8")
            single = len(places) == 1 and "." not in rows.columns[places[0]].name
            shape = (rows.count,) if single else (rows.count, len(places))
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                header = {"descr": kind.str, "fortran_order": False, "shape": shape}
                np.lib.format.write_array_header_2_0(file, header)
                for block in rows.blocks():
                    file.write(block[:, places].astype(kind).tobytes())
            notify(done / len(groups))
        signals = {
            group: [
                {"name": column.name, "unit": column.unit, "is": column.description}
                for column in (rows.columns[k] for k in places)
            ]
            for group, places in groups.items()
        }
        with archive.open(f"{ABOUT}.npy", "w") as file:
            about = json.dumps({"signals": signals, "metadata": dict(rows.metadata)})
            np.lib.format.write_array(file, np.array(about))


def write_mat(rows: LogRows, path: str | Path, notify: Told = silent) -> None:
    """All signals in a new MAT file of version 5, a variable a group: ``q`` is (K, nv), ``t`` is (K, 1).

    ``signals`` and ``units`` are structs with a cell array of names for each group, and ``metadata`` is the
    log's as a JSON text.
    """
    from scipy.io import savemat  # slow to load

    groups = rows.groups()
    largest = 8 * rows.count * max(len(places) for places in groups.values())
    if largest > LARGEST_VARIABLE:
        raise InputError(
            f"{rows.title} has groups of {largest / 1e9:.1f} GB, a MAT file takes 2.1 GB; write NPZ or CSV"
        )
    content: dict[str, Any] = {"metadata": json.dumps(dict(rows.metadata))}
    for key, attribute in (("signals", "name"), ("units", "unit")):
        content[key] = {
            group: np.array([getattr(rows.columns[k], attribute) for k in places], dtype=object)
            for group, places in groups.items()
        }
    with new_file(path) as part:
        whole = rows.whole()
        for done, (name, places) in enumerate(groups.items(), 1):
            kind = np.int64 if all(whole[k] for k in places) else np.float64
            empty = np.empty((0, len(places)))
            content[name] = np.concatenate([empty, *(b[:, places] for b in rows.blocks())]).astype(kind)
            notify(done / len(groups))
        savemat(part, content, appendmat=False, long_field_names=True)
