"""Plans: the door to all methods, and what each makes of a task."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, get_args

import numpy as np

from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.planning.dynamic_program import grid_plan
from ftqp.analysis.planning.fault_plan import Plan, plan_of
from ftqp.analysis.planning.gradient_climb import gradient_plan
from ftqp.analysis.planning.placement import Freedom, better_placed
from ftqp.analysis.planning.plan_settings import Method, PlanSettings, Told
from ftqp.analysis.planning.planning_study import planning_study
from ftqp.analysis.planning.refined_trajectory import smooth_trajectories
from ftqp.analysis.planning.refusals import refuse_illegal, unreached
from ftqp.analysis.planning.self_motion_speeds import constant_plan, spline_plan
from ftqp.analysis.planning.survival_labels import Survivals, survivals
from ftqp.analysis.planning.waypoint_nodes import curve_nodes
from ftqp.analysis.spatial_map import whole_number
from ftqp.analysis.survival.task_path import TaskPath, task_path
from ftqp.core.checks import FloatArray, instance
from ftqp.core.errors import InputError, unknown
from ftqp.model.robot import Robot

START_SPACING = 0.1
"""Arc length between free starts of a method that is no grid [rad or m]."""
NEARLY_BEST = 0.005
"""The smoothest trajectory is taken whose coverage is so near the best one."""


def plan(
    robot: Robot,
    path: Any,
    q0: Any = None,
    method: Method = "dp",
    seed: int = 0,
    *,
    rows: Any = "pose",
    dt: float | None = None,
    settings: PlanSettings | None = None,
    optimise: Sequence[Freedom] = (),
    progress: Told | None = None,
) -> Plan:
    """The trajectory along a path that survives the failure of most joints at most instants.

    ``dp`` is the best one on a grid of configurations; ``spline`` and ``constant`` choose the speed of the
    self-motion, changing or the same all the way; ``gradient`` follows the slope of a local measure. A free
    start matters most: then the arm begins where the initial self-motion is best. With two or more joints to
    spare there is ``dp`` only. Same arguments, same plan. A keyboard interrupt ends a search of placements,
    speeds or splines with the best found so far, once there is one.
    Source: zhang2016; docs/theory/fault-tolerant-plans.md.

    Args:
        robot: The arm; its limits of position and speed are kept, by the plan and after a failure.
        path: A path of ``ftqp.paths``, poses (N + 1, 4, 4), points, or a task of ``task_path``.
        q0: Where the arm starts, (nv,) [rad or m]; None leaves the start free on the first self-motions.
        method: How the self-motion is chosen.
        seed: Of random starts.
        rows: ``"pose"``, ``"position"``, ``"position_axis"`` for position and tool axis, or names of rows.
        dt: The time between samples [s]; None is a 400th of the path's duration.
        settings: The knobs of all methods; None takes the defaults.
        optimise: What may change beside the start: ``"yaw"`` turns the tool about its own z axis, ``"base"``
            moves the arm's base. The plan's goals are then those of the moved path.
        progress: Called with what is done, of how much, and what is being done.

    Raises:
        InputError: An argument is wrong, the path leaves the workspace or the limits, no trajectory that is
            found keeps them, or no joint is to spare.
    """
    instance("robot", robot, Robot, "a Robot")
    if method not in get_args(Method):
        raise unknown("method", method, "plan", get_args(Method))
    whole_number("seed", seed, 0)
    knobs = PlanSettings() if settings is None else settings
    instance("settings", knobs, PlanSettings, "PlanSettings")
    told = progress if progress is not None else _silent
    task = _task(robot, path, rows, dt, q0)
    _refuse_method(task, method)
    moved: dict[str, Any] = {}
    if optimise:
        if q0 is not None:
            raise InputError(
                "q0 is given and the path may move, so that it need not begin there; leave q0 out"
            )
        task, moved = better_placed(task, optimise, knobs, seed, told)
    study = planning_study(task, knobs.spacing)
    start = None if q0 is None else _start(study, task, robot.angles(q0))
    q, found = _METHODS[method](study, task, start, knobs, seed, told)
    refuse_illegal(task, q, method)
    rated = survivals(task, q[None], knobs.stride)
    return plan_of(
        task,
        q,
        coverage=float(rated.coverage[0]),
        stride=knobs.stride,
        method=method,
        settings={"seed": seed, **knobs.text(), **moved, **found},
    )


def _silent(done: int, total: int, what: str) -> None:
    """Tell nobody."""


def _task(robot: Robot, path: Any, rows: Any, dt: float | None, q0: Any) -> TaskPath:
    """The path on its samples."""
    if not isinstance(path, TaskPath):
        return task_path(robot, path, rows=rows, dt=dt, q0=q0)
    if path.robot is not robot and path.digest != path.with_robot(robot).digest:
        raise InputError(
            f"path is a task of another {path.robot.name} than robot, or with another tool, load or limits; "
            "expected the same arm"
        )
    return task_path(robot, path.goals, rows="position_axis" if path.axis else path.rows, dt=path.dt, q0=q0)


def _refuse_method(task: TaskPath, method: str) -> None:
    """Refuses a task without self-motion, and speeds of a self-motion that is no curve."""
    name, r = task.robot.name, task.redundancy
    if r < 1:
        raise InputError(
            f"{name} has {task.robot.nv} joints and the task {task.m} rows, so that no joint is to spare and "
            "there is nothing to plan; expected at least one joint more than rows"
        )
    if r > 1 and method != "dp":
        raise InputError(
            f"method is {method!r} and {name} has {r} joints to spare; a self-motion has one speed with one "
            "joint to spare only: take 'dp'"
        )


def _start(study: GoalStudy, task: TaskPath, q0: FloatArray) -> FloatArray:
    """The start, exactly at the first sample."""
    study.limited.aim(task.goals[0])
    q, left, _ = study.limited.solutions(q0[None], near=True)
    if left[0] > study.tolerance:
        raise InputError(
            f"q0 is not brought onto the first sample of the path ({left[0]:.2g} m are left); expected a "
            "regular start"
        )
    return np.asarray(q[0])


def _starts(study: GoalStudy, task: TaskPath, start: FloatArray | None, seed: int) -> FloatArray:
    """The start, or nodes of the first self-motions where it is free, (s, nv)."""
    if start is not None:
        return start[None]
    nodes = curve_nodes(study, task.goals[:1], spacing=START_SPACING, seed=seed)[0]
    if not len(nodes):
        raise unreached(study, task, 0)
    return nodes


_Found = tuple[FloatArray, dict[str, Any]]


def _by_grid(
    study: GoalStudy,
    task: TaskPath,
    start: FloatArray | None,
    knobs: PlanSettings,
    seed: int,
    told: Told,
) -> _Found:
    """Dynamic programming, smoothed and verified."""
    grid = grid_plan(study, task, start, knobs, seed, told)
    tried = list(smooth_trajectories(study, task, grid.q))
    if not tried:
        raise InputError(
            f"the way through {grid.nodes} nodes does not join to a trajectory on all samples of the path; "
            "take more waypoints or a smaller spacing"
        )
    rated = survivals(task, np.stack([q for _, q in tried]), knobs.stride)
    best = _smoothest(rated)
    about = {
        "coverage_on_grid": grid.coverage,
        "bound": [int(count) for count in grid.bound],
        "nodes_in_all": grid.nodes,
        "width": tried[best][0],
    }
    return tried[best][1], about


def _smoothest(rated: Survivals) -> int:
    """The first that is nearly the best of those within limits; smoother ones come first."""
    legal = rated.legal if rated.legal.any() else np.ones_like(rated.legal)
    best = rated.coverage[legal].max()
    return int(np.argmax(legal & (rated.coverage >= best - NEARLY_BEST)))


def _by_constant(
    study: GoalStudy,
    task: TaskPath,
    start: FloatArray | None,
    knobs: PlanSettings,
    seed: int,
    told: Told,
) -> _Found:
    """The paper's sweep."""
    found = constant_plan(study, task, _starts(study, task, start, seed), knobs, told)
    return found.q, {"theta": float(found.speeds[0])}


def _by_spline(
    study: GoalStudy,
    task: TaskPath,
    start: FloatArray | None,
    knobs: PlanSettings,
    seed: int,
    told: Told,
) -> _Found:
    """A speed that changes over time."""
    found = spline_plan(study, task, _starts(study, task, start, seed), knobs, told)
    return found.q, {"theta": [round(float(speed), 6) for speed in found.speeds]}


def _by_gradient(
    study: GoalStudy,
    task: TaskPath,
    start: FloatArray | None,
    knobs: PlanSettings,
    seed: int,
    told: Told,
) -> _Found:
    """Up the slope of a measure; a free start is that of the best constant speed."""
    starts = _starts(study, task, start, seed)
    if start is None:
        starts = constant_plan(study, task, starts, replace(knobs, select="coverage"), told).q[:1]
    found = gradient_plan(study, task, starts[0], knobs, told)
    return found.q, {"theta": [round(float(speed), 6) for speed in found.speeds]}


_METHODS: Mapping[str, Any] = {
    "dp": _by_grid,
    "constant": _by_constant,
    "spline": _by_spline,
    "gradient": _by_gradient,
}
