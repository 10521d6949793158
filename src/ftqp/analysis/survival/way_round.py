"""Ways round where a path cannot be followed, by the search that ``ftqp.GoTo`` uses."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from ftqp.analysis.goals import random_postures
from ftqp.analysis.survival.continuing import locks_survived, task_session
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.ways.ways import TOLERANCE, Ways
from ftqp.core.checks import FloatArray, IntArray
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Fault
from ftqp.kernel.entry.study_session import StudySession
from ftqp.kernel.layout.ways_room import WayStage

STARTS = 256
"""Starts from which self-motions are looked for at each sample."""
QUIET = 40
"""The search ends when so many solutions in a row lay on known self-motions."""
CURVES = 32
"""Self-motions of a sample at most."""
POINTS = 96
"""Points of each."""
COARSE = 60
"""Intervals of the grid on which they are continued."""


@final
@dataclass(frozen=True, kw_only=True, eq=False)
class Bound:
    """How many joints any posture can do without at some samples of a path; made by ``bound_of``."""

    grid: TaskPath  # The path, on the grid on which continuations go
    stride: int  # Samples of the path between those of the grid
    samples: IntArray  # Of the grid, that are looked at, (K,)

    def counts(self, items: Sequence[int], threads: int | None = None) -> IntArray:
        """How many joints the best posture found can do without, at some of the samples, (items,)."""
        samples = self.samples[list(items)]
        points = sample_postures(self.grid, samples, threads)
        at = np.repeat(samples, [len(found) for found in points])
        count = locks_survived(
            self.grid, np.concatenate(points), at, np.arange(self.grid.robot.nv), threads
        ).sum(axis=1)
        return np.array([count[at == k].max(initial=0) for k in samples], dtype=np.int64)


def bound_of(task: TaskPath, waypoints: int) -> Bound:
    """What looks at some samples of a path.

    Self-motions at each sample are cut at the joint limits; each of their points is continued to the end of
    the path without each joint, on a coarser grid of the same path. Fewer joints than the arm has prove that
    no posture that was found can do without all of them there, whatever plan leads to it.
    """
    if task.redundancy != 1:
        raise InputError(
            f"upper_bound needs one joint more than rows, and {task.robot.name} has {task.robot.nv} joints "
            f"for {task.m}; leave it out"
        )
    grid = task.coarse(max(COARSE, waypoints))
    return Bound(
        grid=grid,
        stride=task.N // grid.N,
        samples=np.unique(np.linspace(0, grid.N, waypoints + 1).astype(np.int64)[:-1]),
    )


def sample_postures(task: TaskPath, samples: IntArray, threads: int | None = None) -> list[FloatArray]:
    """Points of the self-motions at some samples, within the limits, (points, nv) each [rad or m]."""
    session: StudySession = task_session(task)
    starts = random_postures(task.robot, STARTS)
    found = session.spread_curves(
        task.goals[samples], starts, points=POINTS, quiet=QUIET, curves=CURVES, threads=threads
    )
    limits = task.robot.limits
    postures = []
    for goal, count in enumerate(found.counts):
        q = found.q[goal, : abs(int(count))].reshape(-1, task.robot.nv)
        inside = (
            np.isfinite(q).all(axis=1) & (q >= limits.q_min).all(axis=1) & (q <= limits.q_max).all(axis=1)
        )
        postures.append(q[inside])
    return postures


DT = 1e-3
"""The time between places of a way round [s]."""
LOOKS = 5000
"""A slice of the search; slices of any size give the same way."""


def planner_of(task: TaskPath) -> Planner:
    """A planner of the task's arm, which knows what stands around."""
    around = task.around
    scene, clearance = (None, None) if around is None else (around.scene, around.clearance)
    return Planner(task.robot, DT, scene=scene, clearance=clearance)


def way_round(
    task: TaskPath,
    start: FloatArray,
    *,
    faults: Iterable[Fault] = (),
    goals: Iterable[FloatArray] = (),
    pose: FloatArray | None = None,
    tolerance: tuple[float, float] = (TOLERANCE, TOLERANCE),
) -> tuple[FloatArray | None, str]:
    """The joints from rest to rest to a posture or a pose, (ticks, nv), or None, and what was looked for."""
    planner = planner_of(task)
    planner.reset(start)
    for fault in faults:
        planner.report(fault)
    ways = Ways(planner, goals=goals, goal=pose, rows=task.named_rows, tolerance=tolerance)
    while ways.is_searching:
        ways.search_step(LOOKS)
    return (np.array(ways.motion) if ways.stage is WayStage.READY else None), ways.sentence


def nearest_bodies(task: TaskPath, q: FloatArray) -> str:
    """Which bodies come nearest to each other at a posture, in words."""
    found = planner_of(task).distances(q)
    one, other = min(found, key=lambda pair: float(found[pair]))
    return f"{one} to {other}"
