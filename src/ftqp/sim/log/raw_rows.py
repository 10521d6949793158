"""The raw row of a tick: all that has to be kept of it, in one line of numbers, before anything is derived.

A block is one C-ordered float64 array (ticks, width), whose fields lie side by side: ``t`` [s], n numbers for
each of `PER_JOINT`, those of `GEOMETRY`, ``jacobian`` (6 n), and one for each of `SCALARS`. Poses are their
first three rows; ``velocity`` is the path's at the target; ``jacobian`` is that of `Step`. Measures of
singularity are filled in when a block is handed on.

On a moving base (k coordinates) target and tip are in the inertial frame, and ``base_pose`` (12), ``eta`` (k)
and ``base_status`` (1) follow. Of an arm with a drive or sensors of its own n more follow for each of
`SENSED`, what was measured, sent and referred to, and of `FELT`, as far as they are known. ``further`` are
errors of soft tasks and distances of kept points.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.pose import quaternions, rotation_vectors

BLOCK = 2048
"""Ticks of one block, and rows of one chunk of a log, at most."""
PER_JOINT = ("q", "v", "a", "tau", "tau_brake", "lower", "upper", "belief", "truth")
GEOMETRY = (("target", 12), ("velocity", 3), ("tip", 12), ("slack", 6))
SENSED = ("q_measured", "v_measured", "q_command", "v_command", "q_reference", "v_reference")
FELT = ("tau_measured", "tau_demand")
TASK_ROWS = 6
MEASURES = ("sigma_min", "manipulability", "condition")
SCALARS = (
    "position_error", "rotation_error", "scale", "status", "qp_status", "qp_iterations", "qp_residual",
    "step_time", "kappa", *MEASURES, "progress", "path_status",
)  # fmt: skip
"""Single numbers of a raw row; ``step_time`` in ns, all others as in the columns of the same names."""


@final
class RawLayout:
    """Where each field of a raw row lies: its columns by name, and those of all `SCALARS` together."""

    def __init__(
        self, nv: int, coordinates: int | None = None, *, sensed: Sequence[str] = (), further: int = 0
    ) -> None:
        sizes = [("t", 1), *((name, nv) for name in PER_JOINT), *GEOMETRY, ("jacobian", TASK_ROWS * nv)]
        sizes += [(name, 1) for name in SCALARS]
        if coordinates is not None:
            sizes += [("base_pose", 12), ("eta", coordinates), ("base_status", 1)]
        sizes += [(name, nv) for name in sensed]
        sizes += [("further", further)] if further else []
        fields, at = {}, 0
        for name, size in sizes:
            fields[name] = slice(at, at + size)
            at += size
        self.nv, self.coordinates, self.width, self.sensed = nv, coordinates, at, tuple(sensed)
        self.fields: Mapping[str, slice] = MappingProxyType(fields)
        self.scalars = slice(fields[SCALARS[0]].start, fields[SCALARS[-1]].stop)

    def block(self) -> FloatArray:
        """An empty block, (BLOCK, width), of NaN."""
        return np.full((BLOCK, self.width), np.nan)

    def poses(self, block: FloatArray, name: str) -> FloatArray:
        """The poses of a field of 12 numbers as (K, 3, 4); a view of ``block``, (K, width)."""
        view: FloatArray = block[:, self.fields[name]].reshape(len(block), 3, 4)
        return view


AT_REST = 1e-9
"""Speed of the target below which a path has no direction [m/s]."""
MICROSECONDS = 1e-3
"""In a nanosecond."""


def table(raw: FloatArray, layout: RawLayout) -> FloatArray:
    """The rows of a log, (K, columns), in the order of `ftqp.sim.log.signals.columns`."""
    f = layout.fields
    joints = slice(0, f["truth"].stop)
    target, tip = layout.poses(raw, "target"), layout.poses(raw, "tip")
    error = target[:, :, 3] - tip[:, :, 3]
    parts = [
        raw[:, joints],
        *(part for pose in (target, tip) for part in (pose[:, :, 3], quaternions(pose[:, :, :3]))),
        raw[:, f["position_error"]],
        raw[:, f["rotation_error"]],
        np.linalg.norm(raw[:, f["slack"]], axis=1)[:, None],
        raw[:, f["scale"].start : f["qp_residual"].stop],
        MICROSECONDS * raw[:, f["step_time"]],
        raw[:, f["sigma_min"].start : f["condition"].stop],
        raw[:, f["kappa"]],
        across(error, raw[:, f["velocity"]])[:, None],
        raw[:, f["progress"].start : f["path_status"].stop],
    ]
    if layout.coordinates is not None:
        base = layout.poses(raw, "base_pose")
        turns = target[:, :, :3] @ np.swapaxes(tip[:, :, :3], 1, 2)
        parts += [base[:, :, 3], quaternions(base[:, :, :3]), raw[:, f["eta"]]]
        parts += [error, rotation_vectors(turns), raw[:, f["base_status"]]]
    if layout.sensed:
        parts.append(raw[:, f[layout.sensed[0]].start : f[layout.sensed[-1]].stop])
    if "further" in f:
        parts.append(raw[:, f["further"]])
    return np.concatenate(parts, axis=1)


def across(error: FloatArray, velocity: FloatArray) -> FloatArray:
    """Lengths of the parts of errors that are perpendicular to velocities, (K,); all of an error at rest."""
    squared = np.sum(velocity * velocity, axis=1)
    moving = squared > AT_REST**2
    share = np.divide(np.sum(error * velocity, axis=1), squared, out=np.zeros(len(error)), where=moving)
    length: FloatArray = np.linalg.norm(error - share[:, None] * velocity, axis=1)
    return length
