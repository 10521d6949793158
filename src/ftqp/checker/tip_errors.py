"""Where the true tip is against its target, along the rows of the task."""

from functools import lru_cache

import numpy as np
import pinocchio as pin

from ftqp.checker.model_file import ModelFile
from ftqp.checker.trace import ROWS, Trace
from ftqp.core.checks import FloatArray

HALF_TURN = 1e-3
"""Rotations so near to half a turn are left to pinocchio [1 + cosine of the angle]."""


@lru_cache(maxsize=1)
def errors(arm: ModelFile, run: Trace) -> tuple[FloatArray, FloatArray]:
    """Distance [m] and angle [rad] from the true tip to its target along the rows of the task, each (K,).

    Several laws ask for those of one run, so the last ones are kept.
    """
    tip, target = arm.tips(run.q[:-1]), run.target
    wanted = [row in run.rows for row in ROWS]
    distance = (target[:, :3, 3] - tip[:, :3, 3])[:, wanted[:3]]
    if run.axis is not None:
        away, wished = tip[:, :3, :3] @ run.axis, target[:, :3, :3] @ run.axis
        across = np.linalg.norm(np.cross(away, wished), axis=1)
        return np.linalg.norm(distance, axis=1), np.arctan2(across, np.sum(away * wished, axis=1))
    if not any(wanted[3:]):
        return np.linalg.norm(distance, axis=1), np.zeros(len(tip))
    turns = rotation_vectors(target[:, :3, :3] @ tip[:, :3, :3].transpose(0, 2, 1))
    return np.linalg.norm(distance, axis=1), np.linalg.norm(turns[:, wanted[3:]], axis=1)


def rotation_vectors(R: FloatArray) -> FloatArray:
    """The rotation vectors log(R) of rotations, (K, 3) [rad]; of (K, 3, 3).

    log(R) = t w / |w| with w = (R32 - R23, R13 - R31, R21 - R12) / 2 and t = atan2(|w|, (tr R - 1) / 2).
    """
    w = 0.5 * np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1)
    sine, cosine = np.linalg.norm(w, axis=1), 0.5 * (np.trace(R, axis1=1, axis2=2) - 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(sine > 0.0, np.arctan2(sine, cosine) / sine, 1.0)
    result: FloatArray = share[:, None] * w
    for k in np.flatnonzero(cosine < HALF_TURN - 1.0):
        result[k] = pin.log3(R[k])
    return result
