"""The law of tasks that go before that of the tip: what claims that they are kept is true."""

import numpy as np
import pinocchio as pin

from ftqp.checker.model_file import ModelFile
from ftqp.checker.trace import ROWS, HeldTask, Strictness, Trace
from ftqp.core.checks import FloatArray


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
