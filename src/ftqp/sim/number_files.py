"""Columns of numbers from files, strictly read: any table, waypoints, and recorded motions of a base."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from re import search
from typing import final

import numpy as np

from ftqp.core.checks import FloatArray, numbers
from ftqp.core.errors import InputError, nearest
from ftqp.core.npz import npz_arrays
from ftqp.sim.base.disturbances import Recorded


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class TableFile:
    """A file of columns of numbers, and what it may hold."""

    file: Path  # The file
    what: str  # What it is called in a message, for example ``waypoint file``
    sample: str  # What one line holds, for example ``waypoint``
    valid: tuple[str, ...] | None  # Names that its columns may have; None is any
    needed: tuple[str, ...]  # Names of columns that it has in any case
    together: tuple[str, ...] = ()  # Names of columns of which it has all or none

    def wrong(self, why: str) -> InputError:
        """What to say of the file."""
        return InputError(f"{self.what} {self.file}{why}")

    def refuse_missing(self, endings: str) -> None:
        """Refuse what is no file."""
        if not self.file.is_file():
            raise self.wrong(f" does not exist; expected a {endings} file")

    def csv_columns(self) -> dict[str, FloatArray]:
        """The columns of a CSV file in UTF-8 by name, each (K,), K >= 1; values may be infinite or NaN."""
        self.refuse_missing(".csv")
        try:
            text = self.file.read_text("utf-8-sig").splitlines()
        except UnicodeDecodeError as error:
            raise self.wrong(" is not text in UTF-8 with comma-separated values") from error
        except OSError as error:
            raise self.wrong(f" cannot be read: {error.strerror or error}") from error
        places = [place for place, line in enumerate(text) if line.strip()]
        lines = [text[place] for place in places]
        if len(lines) < 2:
            raise self.wrong(f" has {len(lines)} lines, expected a header and at least one {self.sample}")
        header = [name.strip(' "') for name in lines[0].split(",")]
        self.check_names(header)
        try:
            rows = np.loadtxt(lines[1:], delimiter=",", quotechar='"', comments=None, ndmin=2)
        except ValueError as error:
            found = search(r"string (.+) to \S+ at row (\d+), column (\d+)", str(error))
            if found is None:
                why = str(error).partition(";")[0]
                raise self.wrong(f": {why} below the header, expected numbers") from error
            line, name = places[int(found[2]) + 1] + 1, header[min(int(found[3]), len(header)) - 1]
            raise self.wrong(f", line {line}: {name} is {found[1]:.40}, expected a number") from error
        if rows.shape[1] != len(header):
            raise self.wrong(f", line {places[1] + 1} has {rows.shape[1]} values, expected {len(header)}")
        return {name: rows[:, column] for column, name in enumerate(header)}

    def check_names(self, names: list[str]) -> None:
        """Refuse columns that are unknown, there twice, or missing."""
        for name in names:
            if self.valid is not None and name not in self.valid:
                guess, known = nearest(name, self.valid), ", ".join(self.valid)
                raise self.wrong(f": {name!r:.40} is not a column{guess}; expected some of {known}")
            if names.count(name) > 1:
                raise self.wrong(f": column {name!r} appears {names.count(name)} times")
        asked = (*self.needed, *(self.together if set(self.together) & set(names) else ()))
        for name in asked:
            if name not in names:
                raise self.wrong(f": column {name!r} is missing; it has {', '.join(names)}")

    def check_values(self, table: Mapping[str, FloatArray]) -> None:
        """Refuse values that are not finite, and times that do not rise, in columns by name, each (K,)."""
        for name, column in table.items():
            if not np.isfinite(column).all():
                row = int(np.argmax(~np.isfinite(column)))
                raise self.wrong(
                    f": {name} of {self.sample} {row + 1} is {column[row]}, expected a finite number"
                )
        t = table.get("t", np.zeros(0))
        if (np.diff(t) <= 0.0).any():
            row = int(np.argmax(np.diff(t) <= 0.0))
            raise self.wrong(
                f": t does not rise from {self.sample} {row + 1} ({t[row]:g} s) to {row + 2} "
                f"({t[row + 1]:g} s); sort the {self.sample}s by time"
            )


POSITION = ("x", "y", "z")
ORIENTATION = ("qx", "qy", "qz", "qw")
COLUMNS = ("t", *POSITION, *ORIENTATION)


@dataclass(frozen=True, slots=True, kw_only=True)
class WaypointTable:
    """What a waypoint file holds, ready for `ftqp.control.paths.Waypoints`."""

    positions: FloatArray  # (N, 3) [m]
    orientations: FloatArray | None  # unit quaternions x, y, z, w, (N, 4), or ``None``
    times: FloatArray | None  # (N,) [s], or ``None``


def waypoint_table(path: str | Path) -> WaypointTable:
    """The waypoints of a ``.csv`` or ``.npz`` file.

    CSV: the first line names the columns ``t,x,y,z,qx,qy,qz,qw``; t and the quaternion are optional.
    NPZ: arrays of these names, or ``times`` (N,), ``positions`` (N, 3) and ``orientations`` (N, 4).
    """
    given = TableFile(
        file=Path(path), what="waypoint file", sample="waypoint", valid=COLUMNS, needed=POSITION,
        together=ORIENTATION,
    )  # fmt: skip
    given.refuse_missing(".csv or .npz")
    ending = given.file.suffix.lower()
    if ending not in (".csv", ".npz"):
        raise given.wrong(f" ends in {given.file.suffix!r}, expected .csv or .npz")
    try:
        table = given.csv_columns() if ending == ".csv" else _read_npz(given)
    except OSError as error:
        raise given.wrong(f" cannot be read: {error.strerror or error}") from error
    if not len(table["x"]):
        raise given.wrong(" has no waypoint, expected at least one")
    given.check_values(table)
    return WaypointTable(
        positions=np.stack([table[name] for name in POSITION], axis=1),
        orientations=np.stack([table[name] for name in ORIENTATION], axis=1) if "qx" in table else None,
        times=np.array(table["t"]) if "t" in table else None,
    )


def _read_npz(given: TableFile) -> dict[str, FloatArray]:
    """Columns by name; stacked arrays are taken apart."""
    try:
        found = npz_arrays(given.file)
        arrays = {name: numbers(name, value) for name, value in found.items()}
    except ValueError as error:
        raise given.wrong(" is not an NPZ file of numbers") from error
    if "times" in arrays:
        arrays["t"] = arrays.pop("times")
    for stacked, parts in (("positions", POSITION), ("orientations", ORIENTATION)):
        if stacked in arrays:
            value = arrays.pop(stacked)
            if value.ndim != 2 or value.shape[1] != len(parts):
                raise given.wrong(f": {stacked} has shape {value.shape}, expected (N, {len(parts)})")
            arrays |= {name: value[:, column] for column, name in enumerate(parts)}
    given.check_names(list(arrays))
    lengths = {name: value.shape for name, value in arrays.items()}
    if len(set(lengths.values())) > 1 or any(len(shape) != 1 for shape in lengths.values()):
        raise given.wrong(f": arrays have shapes {lengths}, expected the same (N,) for all")
    return arrays


QUATERNION = ("qx", "qy", "qz", "qw")
TURNS = ("rx", "ry", "rz")


def recorded_motion(path: str | Path, coordinates: Sequence[str]) -> Recorded:
    """The recorded disturbance of a CSV file.

    The first line names the columns: ``t`` [s] and any of the base's coordinates [m or rad]; a free base's
    rotation may come as a unit quaternion ``qx,qy,qz,qw`` in place of ``rx,ry,rz``. Times rise; every value
    is finite.
    """
    free = TURNS[0] in coordinates
    valid = ("t", *coordinates, *(QUATERNION if free else ()))
    given = TableFile(
        file=Path(path), what="recording", sample="sample", valid=valid, needed=("t",), together=QUATERNION
    )
    table = given.csv_columns()
    if len(table) < 2:
        raise given.wrong(f": moves nothing, expected some of {', '.join(valid[1:])}")
    if "qx" in table and set(TURNS) & set(table):
        raise given.wrong(": has rx, ry, rz and a quaternion, expected one of them")
    given.check_values(table)
    t = table.pop("t")
    if "qx" in table:
        table |= _turned(given, np.stack([table.pop(name) for name in QUATERNION], axis=1))
    return Recorded(t, table)


def _turned(given: TableFile, quaternions: FloatArray) -> dict[str, FloatArray]:
    """Rotation vectors of unit quaternions, (K, 4)."""
    length = np.linalg.norm(quaternions, axis=1)
    if (np.abs(length - 1.0) > 1e-3).any():
        at = int(np.argmax(np.abs(length - 1.0) > 1e-3))
        raise given.wrong(f": the quaternion of sample {at + 1} has the length {length[at]:.4g}, expected 1")
    from scipy.spatial.transform import Rotation  # slow to load, needed where attitudes are recorded

    vectors = Rotation.from_quat(quaternions).as_rotvec()
    if (np.linalg.norm(np.diff(vectors, axis=0), axis=1) > np.pi).any():
        raise given.wrong(": the base turns by more than half a turn from its nominal attitude")
    return {name: vectors[:, k] for k, name in enumerate(TURNS)}
