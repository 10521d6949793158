"""Plans: the door to all methods, what each makes of a task, and where to put the task."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final, Literal, get_args

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import minimize
from scipy.stats import qmc

from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.planning.dynamic_program import grid_plan
from ftqp.analysis.planning.fault_plan import Plan, plan_of
from ftqp.analysis.planning.nodes import curve_nodes
from ftqp.analysis.planning.plan_case import Method, OnProgress, PlanCase, PlanSettings, silent
from ftqp.analysis.planning.self_motion_speeds import SpeedPlan, constant_plan, null_vectors, spline_plan
from ftqp.analysis.planning.survival_labels import (
    Survivals,
    refuse_illegal,
    refuse_near,
    survivals,
    unreached,
)
from ftqp.analysis.survival.task_path import TaskPath, task_path
from ftqp.control.scene.placed_shapes import Clearance, Scene
from ftqp.core.checks import FloatArray, instance, non_negative, whole_number
from ftqp.core.errors import InputError, unknown
from ftqp.core.pose import rotation_z, transform
from ftqp.model.frames import on_way
from ftqp.model.robot import Robot

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


def better_placed(case: PlanCase, freedoms: Sequence[Freedom]) -> tuple[TaskPath, dict[str, Any]]:
    """The task moved so that a coarse grid with a free start survives most, and how it was moved.

    The task as it is, and placements spread evenly, are compared; a simplex goes on from the best. Moving the
    base by b is moving the path by -b. A keyboard interrupt ends the search with the best so far.
    Source: docs/theory/fault-tolerant-plans.md, "Placement".
    """
    task, settings = case.task, case.settings
    low, high = _box(task, freedoms)
    knobs = replace(settings, waypoints=WAYPOINTS, spacing=max(SPACING, settings.spacing))
    spread = low + qmc.Sobol(len(low), seed=case.seed).random(SPREAD)[: SPREAD - 1] * (high - low)
    spread = np.vstack([np.zeros(len(low)), spread])
    coarse = PlanCase(task=task.coarse(WAYPOINTS), weights=case.weights, settings=knobs, seed=case.seed)
    tried: list[tuple[float, FloatArray]] = []

    def cost(x: FloatArray) -> float:
        """What a coarse grid with a free start does not survive, and how far x is out of the box."""
        inside = np.clip(x, low, high)
        try:
            lost = 1.0 - grid_plan(replace(coarse, task=_moved(coarse.task, freedoms, inside))).coverage
        except InputError:
            lost = LOST
        tried.append((lost + float(np.abs(x - inside).sum()), inside))
        case.notify(min(len(tried), SPREAD + REFINED), SPREAD + REFINED, "placements")
        return tried[-1][0]

    try:
        for x in spread:
            cost(x)
        first = min(tried, key=lambda one: one[0])[1]
        simplex = np.vstack([first, first + 0.15 * np.diag(high - low)])
        ends: Any = {"maxfev": REFINED, "xatol": 1e-3, "fatol": 1e-3}
        minimize(cost, first, method="Nelder-Mead", options=ends | {"initial_simplex": simplex})
    except KeyboardInterrupt:
        if not tried:
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


WIDTHS: Final = (0.0, 0.5, 1.0, 2.0, 4.0)
"""Standard deviations of the smoothing that are tried [waypoints]."""
REACH: Final = 4.0
"""Where the smoothing ends [standard deviations]."""


def smooth_trajectories(
    study: GoalStudy, task: TaskPath, waypoints: FloatArray
) -> Iterator[tuple[float, FloatArray]]:
    """Trajectories through a plan's waypoints, from the smoothest to that which keeps them: width and q.

    Waypoints are averaged with a Gaussian of some width, interpolated (piecewise cubic without overshoot),
    and brought back onto the path by Newton steps. Both ends stay where they are. A width with which the path
    is not met everywhere is left out. Source: docs/theory/fault-tolerant-plans.md, "Refinement".
    """
    for width in sorted(WIDTHS, reverse=True):
        q = _between(_averaged(waypoints, width), task.t)
        exact, left = onto_path(study, task, q)
        if left <= study.tolerance:
            yield width, exact


def onto_path(study: GoalStudy, task: TaskPath, q: FloatArray) -> tuple[FloatArray, float]:
    """Configurations near a path brought onto it, (N + 1, nv), and the largest error left [m]."""
    exact, left, _ = study.limited.solutions(q, goals=task.goals, near=True)
    return exact, float(left.max())


def _averaged(waypoints: FloatArray, width: float) -> FloatArray:
    """A Gaussian average over waypoints; behind an end, values go on mirrored in its point, which stays."""
    reach = min(int(REACH * width), len(waypoints) - 1)
    if reach < 1:
        return waypoints
    first = 2.0 * waypoints[0] - waypoints[reach:0:-1]
    last = 2.0 * waypoints[-1] - waypoints[-2 : -reach - 2 : -1]
    longer = np.vstack([first, waypoints, last])
    smooth = gaussian_filter1d(longer, width, axis=0, truncate=REACH)
    return np.asarray(smooth[reach : reach + len(waypoints)])


def _between(waypoints: FloatArray, t: FloatArray) -> FloatArray:
    """Piecewise cubic between waypoints at even times."""
    times = np.linspace(t[0], t[-1], len(waypoints))
    return np.asarray(PchipInterpolator(times, waypoints, axis=0)(t))


FLOOR = 1e-4
"""Added to n_j^2 so that the measure is finite at a singularity."""
BARRIER = 0.01
"""Weight of the distances from limits, each as a share of half the joint's range."""
EPSILON = 1e-4
"""Step of the slope [rad or m]."""


def gradient_plan(case: PlanCase, start: FloatArray) -> SpeedPlan:
    """The plan with theta = clip(gain dH/ds, fastest), s the way along the self-motion.

    H = sum_j w_j log(n_j^2 + 1e-4) + 0.01 sum_j log(1 - r_j^2), r_j = -1 and 1 at the limits of joint j, w_j
    its weight. It looks at each instant alone. Source: docs/theory/fault-tolerant-plans.md, "A gradient".
    """
    study, task, settings = case.study, case.task, case.settings
    q, speeds = np.empty((task.N + 1, study.robot.nv)), np.empty(task.N)
    q[0] = start
    for k in range(task.N):
        n = null_vectors(study, q[k][None])[0]
        either = measure(study, np.stack([q[k] - EPSILON * n, q[k] + EPSILON * n]), case.weights)
        slope = (either[1] - either[0]) / (2.0 * EPSILON)
        speeds[k] = np.clip(settings.gain * slope, -settings.fastest, settings.fastest)
        ahead = q[k] + task.dt * speeds[k] * n
        exact, left, _ = study.limited.solutions(ahead[None], goals=task.goals[k + 1][None], near=True)
        if left[0] > study.tolerance:
            raise InputError(
                f"{study.robot.name} does not follow the path beyond sample {k} (t = {task.t[k]:g} s) with "
                "the method 'gradient'; take 'dp', or start elsewhere"
            )
        q[k + 1] = exact[0]
        case.notify(k + 1, task.N, "samples")
    return q, speeds


def measure(study: GoalStudy, q: FloatArray, weights: FloatArray) -> FloatArray:
    """H of ``gradient_plan``, (k,)."""
    limits = study.robot.limits
    n = null_vectors(study, q)
    value = (weights * np.log(n * n + FLOOR)).sum(axis=1)
    both = np.isfinite(limits.q_min) & np.isfinite(limits.q_max)
    low, high = limits.q_min[both], limits.q_max[both]
    r = (2.0 * q[:, both] - low - high) / (high - low)
    return np.asarray(value + BARRIER * np.log(np.maximum(1.0 - r * r, FLOOR)).sum(axis=1))


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
    weights: Mapping[str | int, float] | None = None,
    progress: OnProgress | None = None,
    scene: Scene | None = None,
    clearance: Clearance | None = None,
    frame: str | None = None,
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
        optimise: What may change but the start: ``"yaw"`` turns the tool about its own z axis, ``"base"``
            moves the arm's base. The plan's goals are then those of the moved path.
        weights: What a lock of each joint counts, >= 0, by name or index, for example its failure rate or
            1 / MTBF; only their ratios matter, and joints that are left out do not count. None: all alike.
        progress: Called with what is done, of how much, and what is being done.
        scene: What stands around the arm, as it stands now: the plan keeps clear of it, and so must the arm
            after a failure. None is what the path was made with, or nothing.
        clearance: How far the arm keeps from it and from itself; None is ``ftqp.Clearance()`` with a scene.
        frame: Of a robot with branches, the frame that follows the path, by its name; None is its first tip.
            The plan is that of ``robot.arm_to(frame)``, the other joints where ``neutral`` has them, and
            leads a planner of the robot whose first tip that is.

    Raises:
        InputError: An argument is wrong, the path leaves the workspace or the limits, no trajectory that is
            found keeps them, or no joint is to spare.
    """
    instance("robot", robot, Robot, "a Robot")
    if method not in get_args(Method):
        raise unknown("method", method, "plan", get_args(Method))
    whole_number("seed", seed, 0)
    if frame is not None or not robot.is_serial:
        frame = robot.tip if frame is None else frame
        q0 = None if q0 is None else on_way(robot, frame, q0, "q0")
        robot = robot.arm_to(frame)
    knobs = PlanSettings() if settings is None else settings
    instance("settings", knobs, PlanSettings, "PlanSettings")
    task = task_path(robot, path, rows=rows, dt=dt, q0=q0, scene=scene, clearance=clearance)
    _refuse_method(task, method)
    case = PlanCase(
        task=task,
        weights=joint_weights(robot, weights),
        settings=knobs,
        seed=seed,
        notify=silent if progress is None else progress,
    )
    moved: dict[str, Any] = {}
    if optimise:
        if q0 is not None:
            raise InputError(
                "q0 is given and the path may move, so that it need not begin there; leave q0 out"
            )
        task, moved = better_placed(case, optimise)
        case = replace(case, task=task)
    if q0 is not None:
        case = replace(case, start=_start(case, robot.angles(q0)))
    q, found = _METHODS[method](case)
    refuse_illegal(task, q, method)
    rated = survivals(task, q[None], knobs.stride)
    if weights is not None:
        found["weights"] = dict(zip(robot.joints, case.weights.tolist(), strict=True))
        found["weighted_coverage"] = float(survivals(task, q[None], knobs.stride, case.weights).coverage[0])
    return plan_of(
        task,
        q,
        coverage=float(rated.coverage[0]),
        stride=knobs.stride,
        method=method,
        settings={"seed": seed, **knobs.text(), **moved, **found},
    )


def joint_weights(robot: Robot, weights: Mapping[str | int, float] | None) -> FloatArray:
    """What a lock of each joint counts, (nv,), with the mean 1."""
    if weights is None:
        return np.ones(robot.nv)
    instance("weights", weights, Mapping, "numbers by joint, as {'j1': 2.0}")
    found = np.zeros(robot.nv)
    for joint, weight in weights.items():
        found[robot.joint(joint)] = non_negative(f"weight of {joint!r}", weight)
    if len({robot.joint(joint) for joint in weights}) < len(weights):
        raise InputError(f"weights name a joint twice: {', '.join(map(str, weights))}; expected it once")
    if not found.any():
        raise InputError("weights are all zero, expected a joint at least whose failure counts")
    return np.asarray(found / found.mean())


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


def _start(case: PlanCase, q0: FloatArray) -> FloatArray:
    """The start, exactly at the first sample."""
    study, task = case.study, case.task
    study.limited.aim(task.goals[0])
    q, left, _ = study.limited.solutions(q0[None], near=True)
    if left[0] > study.tolerance:
        raise InputError(
            f"q0 is not brought onto the first sample of the path ({left[0]:.2g} m are left); expected a "
            "regular start"
        )
    refuse_near(task, q, "q0")
    return np.asarray(q[0])


def _starts(case: PlanCase) -> FloatArray:
    """The start, or nodes of the first self-motions where it is free, (s, nv)."""
    if case.start is not None:
        return case.start[None]
    nodes = curve_nodes(case.study, case.task.goals[:1], spacing=START_SPACING, seed=case.seed)[0]
    clear = nodes[case.task.clear(nodes)] if len(nodes) else nodes
    if not len(clear):
        raise unreached(case.study, case.task, 0)
    return clear


_Found = tuple[FloatArray, dict[str, Any]]


def _by_grid(case: PlanCase) -> _Found:
    """Dynamic programming, smoothed and verified."""
    grid = grid_plan(case)
    tried = list(smooth_trajectories(case.study, case.task, grid.q))
    if not tried:
        finer = "a smaller spacing" if case.study.redundancy == 1 else "more nodes"
        raise InputError(
            f"the way through {grid.nodes} nodes does not join to a trajectory on all samples of the path; "
            f"take more waypoints or {finer}"
        )
    rated = survivals(case.task, np.stack([q for _, q in tried]), case.settings.stride, case.weights)
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


def _by_constant(case: PlanCase) -> _Found:
    """The paper's sweep."""
    q, speeds = constant_plan(case, _starts(case))
    return q, {"theta": float(speeds[0])}


def _by_spline(case: PlanCase) -> _Found:
    """A speed that changes over time."""
    q, speeds = spline_plan(case, _starts(case))
    return q, {"theta": speeds.round(6).tolist()}


def _by_gradient(case: PlanCase) -> _Found:
    """Up the slope of a measure; a free start is that of the best constant speed."""
    starts = _starts(case)
    if case.start is None:
        by_coverage = replace(case, settings=replace(case.settings, select="coverage"))
        starts = constant_plan(by_coverage, starts)[0][:1]
    q, speeds = gradient_plan(case, starts[0])
    return q, {"theta": speeds.round(6).tolist()}


_METHODS: Mapping[str, Callable[[PlanCase], _Found]] = {
    "dp": _by_grid,
    "constant": _by_constant,
    "spline": _by_spline,
    "gradient": _by_gradient,
}
