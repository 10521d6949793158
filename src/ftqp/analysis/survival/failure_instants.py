"""Pairs of a failure and an instant, each followed to the end of the path on its own."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, final

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from ftqp.analysis.survival.continuing import continuation_study
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.control.batch import rollout
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.target import Targets
from ftqp.control.task.task import Task
from ftqp.core.checks import FloatArray, IntArray
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Fault
from ftqp.kernel.entry.continuation_study import Continuations, ContinuationStudy
from ftqp.kernel.layout.enums import Survival
from ftqp.model.robot import Robot

TICK = 2e-3
"""Time between the planner's steps [s]."""


@final
class PlannerRuns:
    """Runs of a planner (``batch.rollout``) from states of a motion on, faults reported at once."""

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


@final
@dataclass(frozen=True, kw_only=True, eq=False)
class Pairs:
    """All pairs of failures and instants, number = instant * failures + failure; can be pickled."""

    task: TaskPath  # The path, with the rows that are to be kept after a failure
    q: FloatArray  # The motion, (N + 1, nv) [rad or m]
    samples: IntArray  # The instants, (K,)
    failures: tuple[tuple[int, ...], ...]  # The joints of each failure, by index
    speeds: FloatArray  # With which each joint begins to brake, (N + 1, nv) [rad/s or m/s]
    rule: Literal["exact", "qp", "planner"]  # How the others go on
    share: float | None  # What is left of the speed limit of a degraded joint; None: it is locked
    reports: tuple[Fault, ...]  # Of each failure to a planner; none where continuations are computed
    deceleration: FloatArray | None  # As ``continuation_study`` takes it
    tolerance: tuple[float, float]  # Errors that count as survived with ``qp`` and ``planner`` [m, rad]

    def __getstate__(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in self.__dataclass_fields__}

    @property
    def count(self) -> int:
        """How many pairs there are."""
        return len(self.samples) * len(self.failures)

    @cached_property
    def study(self) -> ContinuationStudy:
        """Continuations on the path."""
        return continuation_study(self.task, deceleration=self.deceleration, tolerance=self.tolerance)

    @cached_property
    def _planner(self) -> PlannerRuns:
        return PlannerRuns(self.task, self.q)

    def runs(self, items: Sequence[int], threads: int | None = None, *, best: bool = False) -> Continuations:
        """What becomes of some pairs, or what bounded QPs make of them to the end, whatever the error."""
        column, row = np.divmod(np.asarray(items, dtype=np.int64), len(self.failures))
        at = self.samples[column]
        if self.rule == "planner" and not best:
            return self._run(at, row, threads)
        failed = np.array(self.failures, dtype=np.int64)[row]
        return self.study.runs(
            self.q[at],
            at,
            failed,
            speed=np.take_along_axis(self.speeds[at], failed, axis=1),
            bounded=best or self.rule == "qp",
            whole=best,
            share=self.share,
            threads=threads,
        )

    def _run(self, at: IntArray, row: IntArray, threads: int | None) -> Continuations:
        """Pairs after which the planner goes on."""
        position, rotation, clearance = (np.empty(len(at)) for _ in range(3))
        for sample in np.unique(at):
            some = np.flatnonzero(at == sample)
            faults = [self.reports[k] for k in row[some]]
            position[some], rotation[some], clearance[some] = self._planner.at(int(sample), faults, threads)
        kept = (position <= self.tolerance[0]) & (rotation <= self.tolerance[1])
        keep = -np.inf if self.task.around is None else self.task.around.clearance.keep - self.tolerance[0]
        near = clearance < keep
        return Continuations(
            status=np.select(
                [near, kept], [int(Survival.TOO_NEAR), int(Survival.SURVIVED)], int(Survival.ERROR)
            ),
            sample=np.where(kept & ~near, self.task.N, at),
            position=position,
            rotation=rotation,
            margin=np.full(len(at), np.nan),
            hurry=np.full(len(at), np.nan),
            clearance=clearance,
        )
