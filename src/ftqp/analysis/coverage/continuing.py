"""Compiled continuations and motions at a given self-motion speed of a task."""

from typing import Any

import numpy as np

from ftqp.analysis.coverage.task_path import TaskPath
from ftqp.control.first_use import warm_up
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.kernel.entry.continuation_study import ContinuationStudy
from ftqp.kernel.entry.study_session import StudySession
from ftqp.kernel.layout.record import capacity_for

ENTRIES = (
    "exact_continuations",
    "bounded_continuations",
    "self_speed_tracks",
    "study_values",
    "study_solutions",
)
"""Compiled parts of coverage."""
START_ERROR = 1e-9
"""An error of the start that counts as none [m]."""


def task_session(task: TaskPath) -> StudySession:
    """Studies of the arm with the rows of a task, within its limits; the goal is the first sample.

    Args:
        task: The task.
    """
    robot = task.robot
    limits = robot.limits
    ends = np.isinf(limits.q_min) & np.isinf(limits.q_max)
    session = StudySession(
        robot.chain.constants(),
        task.indices,
        robot.length,
        q_min=limits.q_min,
        q_max=limits.q_max,
        wraps=~robot.chain.prismatic & ends,
        axis=task.axis,
    )
    session.aim(task.goals[0])
    return session


def continuation_study(task: TaskPath, **settings: Any) -> ContinuationStudy:
    """Continuations along a task, with the limits of its robot.

    Args:
        task: The task.
        settings: Tolerances, weight and caution of bounded continuations; see ``ContinuationStudy``.
    """
    warm_up(ENTRIES, capacity_for(task.robot.nv))
    limits = task.robot.limits
    return ContinuationStudy(
        task_session(task), task.goals, task.dt, q_min=limits.q_min, q_max=limits.q_max, v_max=limits.v_max,
        a_max=limits.a_max, **settings,
    )  # fmt: skip


def track(task: TaskPath, q0: Any, theta: Any = 0.0) -> FloatArray:
    """The motion along a task with a given self-motion speed, (N + 1, nv) [rad or m].

        q <- q + dt theta n(q),  then  q <- q + J^+ e  until e counts as none, at every sample

    Speeds of 0 give the least joint velocities. Position and speed limits do not matter here.
    Source: zhang2016, section 2.2; docs/theory/coverage.md, "Self-motion at a given speed".

    Args:
        task: The task.
        q0: The start, (nv,) [rad or m], brought onto the first sample before.
        theta: Self-motion speed, one number or one a sample (N,) [rad/s]; a positive one moves along n with
            det [n; J] > 0.

    Raises:
        InputError: The arm cannot follow the path from there, or speeds are given and it has not one joint
            more than rows.
    """
    q, last = tracks(task, np.asarray(task.robot.angles(q0))[None], theta)
    if last[0] < task.N:
        raise InputError(
            f"{task.robot.name} cannot follow the path beyond sample {last[0]} of {task.N} "
            f"(t = {task.t[last[0]]:.4g} s); expected a path within the workspace, reached from this start"
        )
    return np.asarray(q[0])


def tracks(task: TaskPath, starts: Any, theta: Any = 0.0) -> tuple[FloatArray, Any]:
    """Many such motions on all cores: q, (k, N + 1, nv) [rad or m], and their last samples, (k,).

    Args:
        task: The task.
        starts: The starts, (k, nv) [rad or m].
        theta: Self-motion speeds, one number, one each (k, 1), one a sample (N,), or (k, N) [rad/s].

    Raises:
        InputError: A shape is wrong, no start reaches the first sample, or speeds are given to an arm that
            has not one joint more than rows.
    """
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
