"""Ways round where a path cannot be followed, by the search that ``ftqp.GoTo`` uses."""

from collections.abc import Iterable

import numpy as np

from ftqp.analysis.survival.task_path import TaskPath
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.ways.ways import TOLERANCE, Ways
from ftqp.core.checks import FloatArray
from ftqp.faults.kinds import Fault
from ftqp.kernel.layout.ways_room import WayStage

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
