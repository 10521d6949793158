"""From raw rows to the columns of a log, for a whole block at once."""

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.pose import quaternions, rotation_vectors
from ftqp.sim.log.raw_rows import RawLayout

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
