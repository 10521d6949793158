"""Waypoints from a file: CSV with a header, or NPZ with the same names."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ftqp.core.checks import FloatArray, numbers
from ftqp.core.errors import InputError, nearest
from ftqp.core.npz import npz_arrays
from ftqp.sim.csv_table import csv_columns, refuse_large, refuse_repeated

POSITION = ("x", "y", "z")
ORIENTATION = ("qx", "qy", "qz", "qw")
COLUMNS = ("t", *POSITION, *ORIENTATION)
WHAT = "waypoint file"
LARGEST_FILE = 20_000_000
"""A waypoint file bigger than this is taken for a mistake [bytes]."""
LARGEST_ARRAYS = 200_000_000
"""So are arrays of more than that [bytes]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WaypointTable:
    """What a waypoint file holds, ready for `ftqp.control.paths.Waypoints`.

    Attributes:
        positions: (N, 3) [m].
        orientations: unit quaternions x, y, z, w, (N, 4), or ``None``.
        times: (N,) [s], or ``None``.
    """

    positions: FloatArray
    orientations: FloatArray | None
    times: FloatArray | None


def waypoint_table(path: str | Path) -> WaypointTable:
    """The waypoints of a ``.csv`` or ``.npz`` file.

    CSV: the first line names the columns ``t,x,y,z,qx,qy,qz,qw``; t and the quaternion are optional.
    NPZ: arrays of these names, or ``times`` (N,), ``positions`` (N, 3) and ``orientations`` (N, 4).

    Raises:
        InputError: missing file, not text, unknown or missing column, not a number, NaN, times not rising.
    """
    file = Path(path)
    if not file.is_file():
        raise InputError(f"waypoint file {file} does not exist; expected a .csv or .npz file")
    refuse_large(file, WHAT, LARGEST_FILE)
    if file.suffix.lower() not in (".csv", ".npz"):
        raise InputError(f"waypoint file {file} ends in {file.suffix!r}, expected .csv or .npz")
    try:
        if file.suffix.lower() == ".csv":
            table = csv_columns(file, WHAT, "waypoint", lambda names: _check_names(file, names))
        else:
            table = _read_npz(file)
    except OSError as error:
        raise InputError(f"waypoint file {file} cannot be read: {error.strerror or error}") from error
    return _checked(file, table)


def _read_npz(file: Path) -> dict[str, FloatArray]:
    """Columns by name; stacked arrays are taken apart."""
    try:
        arrays = {name: numbers(name, value) for name, value in npz_arrays(file, LARGEST_ARRAYS).items()}
    except ValueError as error:
        raise InputError(f"waypoint file {file} is not an NPZ file of numbers") from error
    if "times" in arrays:
        arrays["t"] = arrays.pop("times")
    for stacked, parts in (("positions", POSITION), ("orientations", ORIENTATION)):
        if stacked in arrays:
            value = arrays.pop(stacked)
            if value.ndim != 2 or value.shape[1] != len(parts):
                raise InputError(
                    f"waypoint file {file}: {stacked} has shape {value.shape}, expected (N, {len(parts)})"
                )
            arrays |= {name: value[:, column] for column, name in enumerate(parts)}
    _check_names(file, list(arrays))
    lengths = {name: value.shape for name, value in arrays.items()}
    if len(set(lengths.values())) > 1 or any(len(shape) != 1 for shape in lengths.values()):
        raise InputError(
            f"waypoint file {file}: arrays have shapes {lengths}, expected the same (N,) for all"
        )
    return arrays


def _check_names(file: Path, names: list[str]) -> None:
    for name in names:
        if name not in COLUMNS:
            raise InputError(
                f"waypoint file {file}: {name!r:.40} is not a column{nearest(name, COLUMNS)}; "
                f"expected {','.join(COLUMNS)} by header"
            )
    refuse_repeated(file, WHAT, names)
    missing = [name for name in POSITION if name not in names]
    if any(name in names for name in ORIENTATION):
        missing += [name for name in ORIENTATION if name not in names]
    if missing:
        raise InputError(f"waypoint file {file}: column {missing[0]!r} is missing; it has {', '.join(names)}")


def _checked(file: Path, table: Mapping[str, FloatArray]) -> WaypointTable:
    """Refuse what is not finite or not in order."""
    count = len(table["x"])
    if count == 0:
        raise InputError(f"waypoint file {file} has no waypoint, expected at least one")
    for name, column in table.items():
        if not np.isfinite(column).all():
            row = int(np.argmax(~np.isfinite(column)))
            raise InputError(
                f"waypoint file {file}: {name} of waypoint {row + 1} is {column[row]}, "
                "expected a finite number"
            )
    times = table.get("t")
    if times is not None and (np.diff(times) <= 0.0).any():
        row = int(np.argmax(np.diff(times) <= 0.0))
        raise InputError(
            f"waypoint file {file}: t does not rise from waypoint {row + 1} ({times[row]:g} s) "
            f"to {row + 2} ({times[row + 1]:g} s); sort the waypoints by time"
        )
    oriented = "qx" in table
    return WaypointTable(
        positions=np.stack([table[name] for name in POSITION], axis=1),
        orientations=np.stack([table[name] for name in ORIENTATION], axis=1) if oriented else None,
        times=None if times is None else np.array(times),
    )
