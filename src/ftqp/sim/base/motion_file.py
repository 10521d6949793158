"""A recorded base motion from a CSV file, strictly read."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.sim.base.disturbances import Recorded
from ftqp.sim.csv_table import TableFile

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
