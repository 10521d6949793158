"""What remains of a planned path when joints have failed on it: whole, with fewer rows, in part, or back."""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from ftqp.analysis.survival.continuing import continuation_study
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.control.planner.leading_plan import Remaining
from ftqp.core.checks import FloatArray
from ftqp.faults.kinds import Fault, Locked
from ftqp.kernel.layout.enums import SURVIVED
from ftqp.kernel.layout.other_records import FAILED_JOINTS
from ftqp.model.robot import Robot

FEWER: Final = {"pose": ("position_axis", "position"), "position_axis": ("position",)}
"""What rows of a task are given up for, the least first."""
WORDS: Final = {
    "pose": "position and orientation",
    "position_axis": "position and the direction of the tool",
    "position": "position",
}
"""Rows in words."""
SAME_TIME: Final = 1e-9
"""Samples of a plan are distinguished from here on, as a share of their distance."""


class _Motion(NamedTuple):
    """A continuation: whether it gets to the end, its last sample, and the joints on the way."""

    survived: bool
    last: int
    q: FloatArray


def remaining(task: TaskPath, q: FloatArray, at: float, faults: Sequence[Fault]) -> tuple[Remaining, ...]:
    """What can be done after faults at time ``at`` [s] and joints q, (nv,) [rad or m], least lost first.

    Joints that are locked are looked ahead on, at most two, and any that have less speed or range. With less
    torque, or a joint that swings freely, only a stop is known to be possible: what then happens depends on
    loads and speeds, and on the planner itself.
    Source: zhang2016, section 2.1, extended in docs/evidence/zhang2016.md.
    """
    robot = task.robot
    begin = min(int(np.floor(at / task.dt + SAME_TIME)), task.N)
    stand = Remaining(
        kind="stop", rows="", until=at, q=q[None].copy(), sentence=f"stop and stand at {at:.3g} s of the path"
    )
    failed = [robot.joint(fault.joint) for fault in faults if isinstance(fault, Locked)]
    weak = [fault for fault in faults if fault.works and _left(fault, "tau_max") == 1.0]
    if len(failed) + len(weak) < len(faults) or len(failed) > FAILED_JOINTS:
        return (stand,)
    if weak:
        robot = weakened(robot, weak)
        if (q < robot.limits.q_min).any() or (q > robot.limits.q_max).any():
            return (stand,)
        task = task.with_robot(robot)
    own = "position_axis" if task.axis else "pose" if task.m == 6 else "+".join(task.rows)
    found = []
    whole = _continued(task, q, begin, failed)
    if whole is not None and whole.survived:
        end = f"go on to the end of the path with {WORDS.get(own, own)}"
        found.append(Remaining(kind="task", rows=own, until=float(task.t[-1]), q=whole.q, sentence=end))
    else:
        for rows in FEWER.get(own, ()):
            motion = _continued(task.with_rows(rows), q, begin, failed)
            if motion is not None and motion.survived:
                text = f"go on to the end of the path with {WORDS[rows]} only"
                found.append(
                    Remaining(kind="rows", rows=rows, until=float(task.t[-1]), q=motion.q, sentence=text)
                )
        if whole is not None and whole.last > begin:
            time = float(task.t[whole.last])
            text = f"go on with {WORDS.get(own, own)} up to {time:.3g} s of the path, then stop"
            found.append(Remaining(kind="until", rows=own, until=time, q=whole.q, sentence=text))
    found += _retreat(task, q, begin, failed, own)
    return (*found, stand)


def _left(fault: Fault, limit: str) -> float:
    """The share of a limit that a fault leaves."""
    return float(getattr(fault, fault.shares[limit])) if limit in fault.shares else 1.0


def weakened(robot: Robot, faults: Sequence[Fault]) -> Robot:
    """The arm with the speeds and ranges that are left of it."""
    limits = robot.limits
    q_min, q_max, v_max = limits.q_min.copy(), limits.q_max.copy(), limits.v_max.copy()
    for fault in faults:
        i = robot.joint(fault.joint)
        v_max[i] *= _left(fault, "v_max")
        least, most = getattr(fault, "q_min", None), getattr(fault, "q_max", None)
        q_min[i] = q_min[i] if least is None else max(q_min[i], least)
        q_max[i] = q_max[i] if most is None else min(q_max[i], most)
    return robot.with_limits(q_min=q_min, q_max=q_max, v_max=v_max)


def continuation(
    task: TaskPath, q: FloatArray, at: float, faults: Sequence[Fault]
) -> tuple[int, FloatArray] | None:
    """The verified postures after locks, first sample and (k, nv); None where they leave no choice."""
    locks = [fault for fault in faults if isinstance(fault, Locked)]
    choice = task.robot.nv - len(locks) - task.m
    if not locks or len(locks) < len(faults) or len(locks) > FAILED_JOINTS or choice < 1:
        return None
    begin = min(int(np.floor(at / task.dt + SAME_TIME)), task.N)
    found = _continued(task, q, begin, [task.robot.joint(lock.joint) for lock in locks])
    return None if found is None else (begin, found.q)


def _retreat(task: TaskPath, q: FloatArray, begin: int, failed: list[int], own: str) -> list[Remaining]:
    """The way back to the begin of the path, or as far as it goes."""
    if begin == 0:
        return []
    motion = _continued(task.through(task.goals[begin::-1]), q, 0, failed)
    if motion is None or motion.last == 0:
        return []
    time = float(task.t[begin - motion.last])
    where = "the begin of the path" if motion.survived else f"{time:.3g} s of the path, no farther"
    return [
        Remaining(kind="retreat", rows=own, until=time, q=motion.q, sentence=f"go back the way to {where}")
    ]


def _continued(task: TaskPath, q: FloatArray, begin: int, failed: list[int]) -> _Motion | None:
    """The continuation from a sample on; None where too few joints are left for the rows."""
    left = task.robot.nv - len(failed)
    if left < task.m:
        return None
    if begin == task.N:
        return _Motion(True, begin, q[None].copy())
    study, bounded = continuation_study(task), left > task.m
    joints = np.array(failed if failed else [-1], dtype=np.int64)
    run = study.runs(q[None], [begin], joints[None], bounded=bounded)
    survived = int(run.status[0]) == SURVIVED
    last = task.N if survived else max(begin, int(run.sample[0]) - 1)
    way = study.motion(q, begin, joints, bounded=bounded)
    return _Motion(survived, last, way[: last - begin + 1])
