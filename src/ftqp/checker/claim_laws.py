"""The laws of what is claimed: OK is true of the tip, of further tasks and of every joint."""

from functools import lru_cache

import numpy as np
import pinocchio as pin

from ftqp.checker.joint_health import health
from ftqp.checker.model_file import ModelFile
from ftqp.checker.motion_laws import BAND_SIGMAS
from ftqp.checker.trace import ROWS, HeldTask, Strictness, Trace
from ftqp.core.checks import FloatArray

HALF_TURN = 1e-3
"""Rotations so near to half a turn are left to pinocchio [1 + cosine of the angle]."""


@lru_cache(maxsize=1)
def errors(arm: ModelFile, run: Trace) -> tuple[FloatArray, FloatArray]:
    """Distance [m] and angle [rad] from tip to target along the task's rows, (K,); the last are kept."""
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


ERROR_BAND, BAND_TIME = 0.02, 0.1
"""A joint follows its command while it is as near as 0.02 rad or m, six sigma and what it moves in 0.1 s."""


def honesty(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far the tip is beyond the tolerance, as a share of it, while OK is claimed too long, (K, 1)."""
    position_error, rotation_error = errors(arm, run)
    share = np.maximum(position_error / run.tolerance[0], rotation_error / run.tolerance[1])
    claimed = run.claims_ok
    return _lasting(np.where(claimed, share - 1.0, 0.0)[:, None], strict.grace, run.dt)


def tracking(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far the tip is beyond the tolerance although it can follow, as a share of the tolerance, (K, 1)."""
    position_error, rotation_error = errors(arm, run)
    share = np.maximum(position_error / run.tolerance[0], rotation_error / run.tolerance[1]) - 1.0
    known = run.can_be_followed & (run.t < run.until - 0.5 * run.dt)
    return _lasting(np.where(known, share, 0.0)[:, None], strict.grace, run.dt)


def inside(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far a joint that obeys is outside its range while OK is claimed, (K, nv) [rad or m]."""
    obeys, limits = health(arm, run)
    q = run.q[:-1]
    out = np.maximum(q - limits["q_max"], limits["q_min"] - q) - strict.position
    claimed = run.claims_ok[:, None]
    return _lasting(np.where(obeys & claimed, out, 0.0), strict.grace, run.dt)


def obedience(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far a joint is outside its error band, while OK is claimed too long, (K, nv)."""
    band = ERROR_BAND + BAND_SIGMAS * strict.noise + BAND_TIME * np.abs(run.sent_v)
    away = np.abs(run.q[1:] - run.sent_q) - band
    claimed = run.claims_ok[:, None]
    known = np.zeros_like(away, dtype=np.bool_)
    t = run.t
    for failure in run.failures:
        known[t >= failure.reported_at, failure.joint] = True
    return _lasting(np.where(claimed & ~known, away, 0.0), max(strict.grace, 0.05), run.dt)


def _lasting(values: FloatArray, time: float, dt: float) -> FloatArray:
    """Where ``values`` are positive for longer than ``time`` [s]; 0 elsewhere.

    A time in which they are not makes up for as long a one in which they are, so that an interruption now
    and then forgives nothing.
    """
    result = np.zeros_like(values)
    long = round(time / dt)
    if not (values > 0.0).any():
        return result
    for i in range(values.shape[1]):
        since = 0
        for k, value in enumerate(values[:, i] > 0.0):
            since = min(since + 1, long + 1) if value else max(since - 1, 0)
            if value and since > long:
                result[k, i] = values[k, i]
    return result


def tasks(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far tasks before the tip's are beyond the tolerance while OK is claimed too long, (K, 1).

    It is a share of the tolerance, which is that of the tip's task. A task that begins farther from its
    target is judged from when it first comes within.
    """
    result = np.zeros((len(run.status), 1))
    claimed = run.claims_ok
    long = round(strict.grace / run.dt)
    for task in run.held:
        position, rotation = task_errors(arm, run.q[:-1], task)
        share = np.maximum(position / run.tolerance[0], rotation / run.tolerance[1]) - 1.0
        arrived = np.logical_or.accumulate(share <= 0.0)
        since = 0
        for k, wrong in enumerate(claimed & arrived & (share > 0.0)):
            since = since + 1 if wrong else 0
            if since > long:
                result[k, 0] = max(result[k, 0], share[k])
    return result


def task_errors(arm: ModelFile, q: FloatArray, task: HeldTask) -> tuple[FloatArray, FloatArray]:
    """Distance [m] and angle [rad] of a task from its target along the rows that count, each (K,)."""
    none, target = np.zeros(len(q)), task.target
    if task.kind == "centre_of_mass":
        return _length((target - arm.centres(q))[:, _places(task)]), none
    frame = arm.poses(q, task.joint, task.at_zero)
    if task.kind == "position":
        return _length((target - frame[:, :3, 3])[:, _places(task)]), none
    other = None if task.other_at_zero is None else arm.poses(q, task.other, task.other_at_zero)
    if task.kind == "axis":
        return none, _pointing(frame, other, task)
    goal = np.tile(target, (len(q), 1, 1)) if other is None else other @ target
    turned = goal[:, :3, :3] @ frame[:, :3, :3].transpose(0, 2, 1)
    turns = np.array([pin.log3(R) for R in turned])[:, [row in task.rows for row in ROWS[3:]]]
    return _length((goal - frame)[:, :3, 3][:, _places(task)]), _length(turns)


def _pointing(frame: FloatArray, other: FloatArray | None, task: HeldTask) -> FloatArray:
    """The angle between an axis and where it should point, (K,) [rad]."""
    assert task.axis is not None
    axis = frame[:, :3, :3] @ task.axis
    wished = np.tile(task.target, (len(frame), 1)) if other is None else other[:, :3, 3]
    if task.towards:
        wished = wished - frame[:, :3, 3]
    across = np.linalg.norm(np.cross(axis, wished), axis=1)
    result: FloatArray = np.arctan2(across, np.sum(axis * wished, axis=1))
    return result


def _places(task: HeldTask) -> list[bool]:
    return [row in task.rows for row in ROWS[:3]]


def _length(errors: FloatArray) -> FloatArray:
    result: FloatArray = np.linalg.norm(errors, axis=1)
    return result
