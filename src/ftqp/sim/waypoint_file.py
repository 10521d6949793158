"""Waypoints from a file: CSV with a header, or NPZ with the same names."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ftqp.core.checks import FloatArray, numbers
from ftqp.core.npz import npz_arrays
from ftqp.sim.csv_table import TableFile

POSITION = ("x", "y", "z")
ORIENTATION = ("qx", "qy", "qz", "qw")
COLUMNS = ("t", *POSITION, *ORIENTATION)
LARGEST_ARRAYS = 200_000_000
"""Arrays of more than that are taken for a mistake [bytes]."""


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
        found = npz_arrays(given.file, LARGEST_ARRAYS)
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
