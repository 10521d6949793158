"""Failures of a motion with which the planner itself goes on, in closed loop."""

from collections.abc import Sequence
from typing import final

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from ftqp.analysis.survival.task_path import TaskPath
from ftqp.control.batch import rollout
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.target import Targets
from ftqp.control.task.task import Task
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Fault
from ftqp.model.robot import Robot

TICK = 2e-3
"""Time between the planner's steps [s]."""


@final
class PlannerRuns:
    """Runs of a planner of the task's rows that is told of faults at once, from states of a motion on.

    ``ftqp.batch.rollout`` drives it from the motion's state at a sample to the end of the path. A joint that
    swings freely moves by gravity and by what the others do, so for it there is no other way.
    """

    def __init__(self, task: TaskPath, q: FloatArray) -> None:
        self._task, self._q, self._v = task, q, np.gradient(q, task.dt, axis=0)
        around = task.around
        self._planner = Planner(
            task.robot,
            dt=TICK,
            task=Task(rows=task.named_rows, degrade=()),
            scene=None if around is None else around.scene,
            clearance=None if around is None else around.clearance,
        )

    def at(
        self, sample: int, faults: Sequence[Fault], threads: int | None = None
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The largest errors after each of some faults at a sample, and least clearances, (faults,) each."""
        done = rollout(
            self._planner,
            np.tile(self._q[sample], (len(faults), 1)),
            np.tile(self._v[sample], (len(faults), 1)),
            _targets(self._task, float(self._task.t[sample])),
            faults=list(faults),
            threads=threads,
        )
        return done.position_error, done.rotation_error, done.clearance


def refuse_no_masses(robot: Robot) -> None:
    """Refuses to let a joint swing freely on an arm without masses."""
    if not robot.has_inertia:
        raise InputError(
            f"{robot.name} has no masses, so nobody knows how a free joint swings; give the model its "
            "masses, or take fault='locked'"
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
