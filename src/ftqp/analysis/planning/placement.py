"""Where to put the task: the yaw of the tool and the arm's base, by what a coarse grid can survive."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal, get_args

import numpy as np
from scipy.optimize import minimize
from scipy.stats import qmc

from ftqp.analysis.planning.dynamic_program import grid_plan
from ftqp.analysis.planning.plan_case import Here, PlanCase, packed, unpacked
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, unknown
from ftqp.core.pose import rotation_z, transform

Freedom = Literal["yaw", "base"]
"""What a search may change beside the start."""

WAYPOINTS = 30
SPACING = 0.12
"""The coarse grid of the search."""
SPREAD = 16
"""Placements that are spread over all of them."""
REFINED = 24
"""Placements on the way down from the best of these."""
BASE = 0.5
"""How far the base moves each way along x, y and z, as a share of the reach's sixth."""
LOST = 2.0
"""What a placement costs with which the path is not followed at all."""


def placement_cost(case: PlanCase, freedoms: Sequence[Freedom], threads: int | None, x: FloatArray) -> float:
    """What a placement costs: the share that a coarse grid with a free start does not survive."""
    there = _moved(case.task, freedoms, x)
    try:
        return 1.0 - grid_plan(replace(case, task=there, portions=Here(threads))).coverage
    except InputError:
        return LOST


def placement_costs(
    cost: Callable[[FloatArray], float], placements: FloatArray, items: Sequence[int]
) -> list[float]:
    """What each of some placements costs."""
    return [cost(placements[item]) for item in items]


def better_placed(case: PlanCase, freedoms: Sequence[Freedom]) -> tuple[TaskPath, dict[str, Any]]:
    """The task moved so that a coarse grid with a free start survives most, and how it was moved.

    The task as it is, and placements spread evenly, are compared; a simplex goes on from the best. Moving the
    base by b is moving the path by -b. A keyboard interrupt ends the search with the best so far, unless what
    is done is kept.
    Source: docs/theory/fault-tolerant-plans.md, "Placement".
    """
    task, settings, portions = case.task, case.settings, case.portions
    low, high = _box(task, freedoms)
    knobs = replace(settings, waypoints=WAYPOINTS, spacing=max(SPACING, settings.spacing))
    spread = low + qmc.Sobol(len(low), seed=case.seed).random(SPREAD)[: SPREAD - 1] * (high - low)
    spread = np.vstack([np.zeros(len(low)), spread])
    coarse = PlanCase(task=task.coarse(WAYPOINTS), weights=case.weights, settings=knobs, seed=case.seed)
    work = partial(placement_cost, coarse, tuple(freedoms), portions.threads)
    tried: list[tuple[float, FloatArray]] = []

    def kept(value: float, x: FloatArray) -> float:
        inside = np.clip(x, low, high)
        whole = value + float(np.abs(x - inside).sum())
        tried.append((whole, inside))
        case.told(min(len(tried), SPREAD + REFINED), SPREAD + REFINED, "placements")
        return whole

    def cost(x: FloatArray) -> float:
        inside, item = np.clip(x, low, high), len(tried) - SPREAD
        return kept(float(unpacked(portions.one("moves", item, lambda: packed(work(inside))))), x)

    try:
        spreading = partial(placement_costs, work, spread)
        for x, found in zip(spread, case.each("placements", spreading, SPREAD), strict=True):
            kept(float(found), x)
        first = min(tried, key=lambda one: one[0])[1]
        simplex = np.vstack([first, first + 0.15 * np.diag(high - low)])
        minimize(
            cost,
            first,
            method="Nelder-Mead",
            options={"maxfev": REFINED, "initial_simplex": simplex, "xatol": 1e-3, "fatol": 1e-3},
        )
    except KeyboardInterrupt:
        if portions.keeps or not tried:
            raise
    value, x = min(tried, key=lambda one: one[0])
    if value >= LOST:
        raise InputError(
            f"no placement of the path is found that {task.robot.name} follows; expected a path near its "
            "workspace"
        )
    names = _names(task, freedoms)
    return _moved(task, freedoms, x), {"moved": {n: float(v) for n, v in zip(names, x, strict=True)}}


def _names(task: TaskPath, freedoms: Sequence[Freedom]) -> list[str]:
    """Names of the values that a placement has."""
    base = [f"base_{row}" for row in ("x", "y", "z") if row in task.rows]
    return (["yaw"] if "yaw" in freedoms else []) + (base if "base" in freedoms else [])


def _box(task: TaskPath, freedoms: Sequence[Freedom]) -> tuple[FloatArray, FloatArray]:
    """The range of each value of a placement."""
    for freedom in freedoms:
        if freedom not in get_args(Freedom):
            raise unknown("freedom", freedom, "plan", get_args(Freedom))
    if "yaw" in freedoms and (task.axis or "rz" not in task.rows):
        raise InputError(
            f"optimise has 'yaw' and the task the rows {', '.join(task.rows)}, for which the turn of the "
            "tool does not count; leave it out"
        )
    way = BASE * task.robot.length
    high = np.array([np.pi if name == "yaw" else way for name in _names(task, freedoms)])
    return -high, high


def _moved(task: TaskPath, freedoms: Sequence[Freedom], x: FloatArray) -> TaskPath:
    """The task with a placement."""
    goals, by = task.goals.copy(), np.zeros(3)
    for name, value in zip(_names(task, freedoms), x, strict=True):
        if name == "yaw":
            goals = goals @ transform(rotation_z(float(value)), np.zeros(3))
        else:
            by["xyz".index(name[-1])] = -value
    goals[:, :3, 3] += by
    moved = task.through(goals)
    return moved.among(task.around.moved(task.robot, by)) if task.around is not None and by.any() else moved
