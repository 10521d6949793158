"""Compiled continuations and motions at a given self-motion speed of a task."""

from typing import Any

import numpy as np

from ftqp.analysis.survival.task_path import TaskPath
from ftqp.control.inverse_kinematics.posture_search import robot_session, task_rows
from ftqp.core.checks import BoolArray, FloatArray, IntArray
from ftqp.core.errors import InputError
from ftqp.kernel.entry.continuation_study import ContinuationStudy
from ftqp.kernel.entry.study_session import StudySession
from ftqp.kernel.layout.enums import SURVIVED
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.model.robot import Robot

START_ERROR = 1e-9
"""An error of the start that counts as none [m]."""


def task_session(task: TaskPath) -> StudySession:
    """Studies of the arm with the rows of a task, within its limits; the goal is the first sample."""
    session = rows_session(task.robot, task.named_rows)
    if task.around is not None:
        session.keep_clear(task.around.room)
    session.aim(task.goals[0])
    return session


def rows_session(robot: Robot, rows: Any) -> StudySession:
    """Studies of an arm with some task rows, within its limits."""
    names, axis = task_rows(robot, rows)
    return robot_session(robot, [COMPONENTS.index(name) for name in names], axis=axis)


def path_values(task: TaskPath, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Errors (N + 1, m) and Jacobians (N + 1, m, nv) of the task rows along a motion, rotation in rad."""
    session = task_session(task)
    e, A = np.empty((len(q), task.m)), np.empty((len(q), task.m, task.robot.nv))
    for k, goal in enumerate(task.goals[: len(q)]):
        session.aim(goal)
        e[k], A[k] = (values[0] for values in session.values(q[k : k + 1])[:2])
    scale = np.array([task.robot.length if index > 2 else 1.0 for index in task.indices])
    return e / scale, A / scale[:, None]


def locks_survived(
    task: TaskPath,
    q: FloatArray,
    samples: IntArray,
    joints: IntArray | None = None,
    threads: int | None = None,
) -> BoolArray:
    """Whether the path is finished after a lock of each joint at some postures, (k, joints)."""
    which = np.arange(task.robot.nv) if joints is None else joints
    each, at = np.repeat(q, len(which), axis=0), np.repeat(samples, len(which))
    failed, bounded = np.tile(which, len(q)), task.redundancy > 1
    found = continuation_study(task).runs(each, at, failed, bounded=bounded, threads=threads)
    return np.asarray((found.status == SURVIVED).reshape(len(q), len(which)))


def continuation_study(
    task: TaskPath, *, deceleration: Any = None, tolerance: tuple[float, float] = (2e-3, 2e-2)
) -> ContinuationStudy:
    """Continuations along a task, with the limits of its robot."""
    limits = task.robot.limits
    return ContinuationStudy(
        task_session(task),
        task.goals,
        task.dt,
        q_min=limits.q_min,
        q_max=limits.q_max,
        v_max=limits.v_max,
        a_max=0.25 * limits.a_max if deceleration is None else deceleration,
        near=tolerance[0],
        turned=tolerance[1],
    )


def track(task: TaskPath, q0: Any, theta: Any = 0.0) -> FloatArray:
    """The motion along a task with a given self-motion speed, (N + 1, nv) [rad or m].

        q <- q + dt theta n(q),  then  q <- q + J^+ e  until e counts as none, at every sample

    Speeds of 0 give the least joint velocities. Position and speed limits do not matter here.
    Source: zhang2016, section 2.2; docs/theory/coverage.md, "Self-motion at a given speed".

    Args:
        task: The task.
        q0: The start, (nv,) [rad or m], brought onto the first sample before.
        theta: Self-motion speed, a number or (N,) [rad/s]; a positive one moves along n with det [n; J] > 0.

    Raises:
        InputError: The arm cannot follow the path from there, or speeds are given without one joint to spare.
    """
    q, last = tracks(task, np.asarray(task.robot.angles(q0))[None], theta)
    if last[0] < task.N:
        raise InputError(
            f"{task.robot.name} cannot follow the path beyond sample {last[0]} of {task.N} "
            f"(t = {task.t[last[0]]:.4g} s); expected a path within the workspace, reached from this start"
        )
    return np.asarray(q[0])


def tracks(task: TaskPath, starts: Any, theta: Any = 0.0) -> tuple[FloatArray, Any]:
    """Many such motions on all cores: q, (k, N + 1, nv) [rad or m], and their last samples, (k,)."""
    starts = np.atleast_2d(np.asarray(starts, dtype=np.float64))
    try:
        speeds = np.broadcast_to(np.asarray(theta, dtype=np.float64), (len(starts), task.N))
    except ValueError as error:
        raise InputError(
            f"theta has shape {np.shape(theta)}, expected one number, one a sample (N,) = ({task.N},), or "
            f"(k, N) = ({len(starts)}, {task.N})"
        ) from error
    if not np.isfinite(speeds).all():
        raise InputError("theta is not finite, expected self-motion speeds [rad/s]")
    if speeds.any() and task.redundancy != 1:
        raise InputError(
            f"theta is given and {task.robot.name} has {task.robot.nv} joints for {task.m} rows; self-motion "
            "has one speed only where there is one joint more than rows"
        )
    study = continuation_study(task)
    q, left, _ = task_session(task).solutions(starts, task.goals[:1])
    if not (left <= START_ERROR).any():
        raise InputError(
            f"no start of {task.robot.name} reaches the first sample of the path (nearest: {left.min():.3g} "
            "m off); expected a path that begins within the workspace"
        )
    motions, last, _ = study.tracks(np.where((left <= START_ERROR)[:, None], q, starts), speeds)
    return motions, np.where(left <= START_ERROR, last, 0)
