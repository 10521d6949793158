"""Failures of a motion with which the planner itself goes on, in closed loop."""

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from ftqp.analysis.survival.task_path import TaskPath
from ftqp.control.batch import rollout
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.target import Targets
from ftqp.control.task.task import Task
from ftqp.core.checks import FloatArray, IntArray
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Fault, FreeSwinging
from ftqp.kernel.entry.continuation_study import Continuations
from ftqp.kernel.layout.survival import Survival

TICK = 2e-3
"""Time between the planner's steps [s]."""


def planner_runs(
    task: TaskPath,
    q: FloatArray,
    samples: IntArray,
    faults: Sequence[Fault],
    tolerance: tuple[float, float],
    threads: int | None = None,
) -> Continuations:
    """What becomes of the task when the planner goes on after each fault, at each sample.

    ``ftqp.batch.rollout`` drives a planner of the task's rows, which is told at once, from the motion's state
    at the sample to the end of the path. A pair is survived where the errors stay within the tolerances. A
    joint that swings freely moves by gravity and by what the others do, so for it there is no other way.

    Args:
        task: The task.
        q: The motion, (N + 1, nv) [rad or m].
        samples: At which samples joints fail, (K,).
        faults: How they fail, each on its own.
        tolerance: Errors that count as survived [m, rad].
        threads: How many threads share the work; None is one a core.

    Raises:
        InputError: A joint swings freely on an arm that has no masses.
    """
    robot = task.robot
    if not robot.has_inertia and any(isinstance(fault, FreeSwinging) for fault in faults):
        raise InputError(
            f"{robot.name} has no masses, so nobody knows how a free joint swings; give the model its "
            "masses, or take fault='locked'"
        )
    rows = "position_axis" if task.axis else task.rows
    planner = Planner(robot, dt=TICK, task=Task(rows=rows))
    v = np.gradient(q, task.dt, axis=0)
    shape = (len(faults), len(samples))
    position, rotation = np.empty(shape), np.empty(shape)
    for column, k in enumerate(samples):
        done = rollout(
            planner,
            np.tile(q[k], (len(faults), 1)),
            np.tile(v[k], (len(faults), 1)),
            _targets(task, float(task.t[k])),
            faults=list(faults),
            threads=threads,
        )
        position[:, column], rotation[:, column] = done.position_error, done.rotation_error
    kept = (position <= tolerance[0]) & (rotation <= tolerance[1])
    return Continuations(
        status=np.where(kept, int(Survival.SURVIVED), int(Survival.ERROR)).ravel(),
        sample=np.where(kept, task.N, np.broadcast_to(samples, shape)).ravel(),
        position=position.ravel(),
        rotation=rotation.ravel(),
        margin=np.full(position.size, np.nan),
        hurry=np.full(position.size, np.nan),
    )


def _targets(task: TaskPath, begin: float) -> Targets:
    """The path from a time on, at the planner's ticks: splines through the samples."""
    t = np.arange(begin, float(task.t[-1]) + 0.5 * TICK, TICK)
    place = CubicSpline(task.t, task.goals[:, :3, 3])
    turn = RotationSpline(task.t, Rotation.from_matrix(task.goals[:, :3, :3]))
    rotation = turn(t)
    poses = np.tile(np.eye(4), (len(t), 1, 1))
    poses[:, :3, 3], poses[:, :3, :3] = place(t), rotation.as_matrix()
    return Targets(
        poses,
        np.hstack([place(t, 1), rotation.apply(turn(t, 1))]),
        np.hstack([place(t, 2), rotation.apply(turn(t, 2))]),
    )
