"""A recorded base motion from a CSV file, strictly read."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, nearest
from ftqp.sim.base.disturbances import Recorded
from ftqp.sim.csv_table import csv_columns, refuse_large, refuse_repeated

QUATERNION = ("qx", "qy", "qz", "qw")
TURNS = ("rx", "ry", "rz")
WHAT = "recording"
LARGEST_FILE = 100_000_000
"""A file bigger than this is taken for a mistake [bytes]."""


def recorded_motion(path: str | Path, coordinates: Sequence[str]) -> Recorded:
    """The recorded disturbance of a CSV file.

    The first line names the columns: ``t`` [s] and any of the base's coordinates [m or rad]; a free base's
    rotation may come as a unit quaternion ``qx,qy,qz,qw`` in place of ``rx,ry,rz``. Times rise; every value
    is finite.

    Args:
        path: the file.
        coordinates: names of the base's coordinates.

    Raises:
        InputError: missing file, not text, unknown or missing column, not a number, NaN, times not rising.
    """
    file = Path(path)
    if not file.is_file():
        raise InputError(f"recording {file} does not exist; expected a .csv file")
    refuse_large(file, WHAT, LARGEST_FILE)
    table = csv_columns(file, WHAT, "sample", lambda names: _check_names(file, names, coordinates))
    for name, column in table.items():
        if not np.isfinite(column).all():
            row = int(np.argmax(~np.isfinite(column)))
            raise InputError(
                f"recording {file}, line {row + 2}, column {name!r} is {column[row]}, "
                "expected a finite number"
            )
    t = table.pop("t")
    if (np.diff(t) <= 0.0).any():
        at = int(np.argmax(np.diff(t) <= 0.0))
        raise InputError(
            f"recording {file}: t does not rise from sample {at + 1} ({t[at]:g} s) to {at + 2} "
            f"({t[at + 1]:g} s)"
        )
    if "qx" in table:
        table |= _turned(file, np.stack([table.pop(name) for name in QUATERNION], axis=1))
    return Recorded(t, table)


def _check_names(file: Path, header: list[str], coordinates: Sequence[str]) -> None:
    valid = ["t", *coordinates, *(QUATERNION if "rx" in coordinates else ())]
    for name in header:
        if name not in valid:
            raise InputError(
                f"recording {file}: {name!r:.40} is not a column{nearest(name, valid)}; "
                f"expected t and some of {', '.join(valid[1:])}"
            )
    refuse_repeated(file, WHAT, header)
    missing = ["t"] if "t" not in header else []
    if any(name in header for name in QUATERNION):
        missing += [name for name in QUATERNION if name not in header]
        if any(name in header for name in TURNS):
            raise InputError(f"recording {file}: has rx, ry, rz and a quaternion, expected one of them")
    if missing:
        raise InputError(f"recording {file}: column {missing[0]!r} is missing; it has {', '.join(header)}")
    if len(header) < 2:
        raise InputError(f"recording {file}: moves nothing, expected some of {', '.join(valid[1:])}")


def _turned(file: Path, quaternions: FloatArray) -> dict[str, FloatArray]:
    """Rotation vectors of unit quaternions, (K, 4)."""
    length = np.linalg.norm(quaternions, axis=1)
    if (np.abs(length - 1.0) > 1e-3).any():
        at = int(np.argmax(np.abs(length - 1.0) > 1e-3))
        raise InputError(
            f"recording {file}, line {at + 2}: the quaternion has the length {length[at]:.4g}, expected 1"
        )
    from scipy.spatial.transform import Rotation  # slow to load, needed where attitudes are recorded

    vectors = Rotation.from_quat(quaternions).as_rotvec()
    if (np.linalg.norm(np.diff(vectors, axis=0), axis=1) > np.pi).any():
        raise InputError(
            f"recording {file}: the base turns by more than half a turn from its nominal attitude"
        )
    return {name: vectors[:, k] for k, name in enumerate(TURNS)}
