"""Plans by the speed of the self-motion: one speed for all of a path, a spline over time, or a gradient."""

from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import minimize

from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.planning.plan_case import PlanCase, in_parts
from ftqp.analysis.planning.survival_labels import survivals
from ftqp.analysis.survival.continuing import continuation_study
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.analysis.tolerance import null_vector
from ftqp.core.checks import BoolArray, FloatArray
from ftqp.core.errors import InputError

COARSE = 60
"""Intervals of the grid on which candidates are compared first."""
STARTS = 48
"""Starts that are compared where the start is free."""
FINALISTS = 3
"""Starts whose speeds are compared on all samples."""
TENTH = 10
"""Starts are compared at every so-many-th speed."""
VANISHED = 1e-3
"""A component of the null vector that small is a singularity after a lock, as the paper's test sees it."""
OUT_OF_LIMITS = 1.0
"""What a spline pays for each rad or m beyond a limit, in coverage."""


SpeedPlan = tuple[FloatArray, FloatArray]
"""A trajectory, (N + 1, nv) [rad or m], and the speed of its self-motion between samples, (N,) [rad/s]."""


def constant_plan(case: PlanCase, starts: FloatArray) -> SpeedPlan:
    """The best plan with one speed: q_dot = J^+ (x_dot + K e) + theta n, theta swept.

    Speeds with which the arm leaves its limits are left out, where there are others. By coverage the best is
    taken, of equal ones that with the least energy. The paper's rule takes the least energy of those on which
    no component of n changes its sign, which says nothing of what happens after the lock.
    Source: zhang2016, section 3; docs/theory/fault-tolerant-plans.md, "One speed".
    """
    thetas = np.array(case.settings.thetas)
    if len(starts) > FINALISTS:
        starts = _finalists(case, starts, thetas[:: min(TENTH, max(1, len(thetas) // 3))])
    begins, speeds = np.repeat(starts, len(thetas), axis=0), np.tile(thetas, len(starts))
    q, kept = _tracks(case.task, begins, speeds)
    best = _best(case, q, begins[kept], speeds[kept])
    return q[best], np.full(case.task.N, speeds[kept][best])


def spline_plan(case: PlanCase, starts: FloatArray) -> SpeedPlan:
    """The best plan found with a speed that changes over time: a spline through some knots.

    Nelder and Mead's simplex goes down 1 - (survived + completed/2) plus what is beyond the limits, from the
    best constant speed on. Source: docs/theory/fault-tolerant-plans.md, "A spline of speeds".
    """
    task, settings, weights = case.task, case.settings, case.weights
    begin = constant_plan(case, starts)
    coarse, start, speed = task.coarse(COARSE), begin[0][0], float(begin[1][0])
    knots = np.linspace(task.t[0], task.t[-1], settings.knots)
    best = np.inf, np.full(settings.knots, speed)
    tried = 0

    def speeds_at(x: FloatArray, t: FloatArray) -> FloatArray:
        curve = PchipInterpolator(knots, x)(t[:-1])
        return np.asarray(np.clip(curve, -settings.fastest, settings.fastest))

    def cost(x: FloatArray) -> float:
        nonlocal tried, best
        value = loss(x)
        tried += 1
        if value < best[0]:
            best = value, x.copy()
        case.notify(min(tried, settings.evaluations), settings.evaluations, "splines")
        return value

    def loss(x: FloatArray) -> float:
        q, last, _ = continuation_study(coarse).tracks(start[None], speeds_at(x, coarse.t)[None])
        if last[0] < coarse.N:
            return 2.0 + OUT_OF_LIMITS - float(last[0]) / coarse.N
        found = survivals(coarse, q, 1, weights)
        beyond = found.excess[0] + max(0.0, found.hurry[0] - 1.0)
        return float(1.0 - found.coverage[0] - 0.5 * found.completed[0] + OUT_OF_LIMITS * beyond)

    first = best[1]
    spread = 0.25 * max(0.2, abs(speed))
    simplex = np.vstack([first, first + spread * np.eye(settings.knots)])
    options: Any = {
        "maxfev": settings.evaluations, "initial_simplex": simplex, "xatol": 1e-4, "fatol": 1e-5,
    }  # fmt: skip
    with suppress(KeyboardInterrupt):  # the best so far is taken
        minimize(cost, first, method="Nelder-Mead", options=options)
    speeds = speeds_at(best[1], task.t)
    q, last, _ = continuation_study(task).tracks(start[None], speeds[None])
    if last[0] < task.N:
        return begin
    both = survivals(task, np.stack([begin[0], q[0]]), settings.stride, weights)
    better = (both.legal[1], both.coverage[1]) > (both.legal[0], both.coverage[0])
    return (q[0], speeds) if better else begin


def start_rating(task: TaskPath, start: FloatArray, thetas: FloatArray, weights: FloatArray) -> float:
    """Coverage with the best of some constant speeds from a start, less 1 beyond limits."""
    begins, speeds = np.tile(start, (len(thetas), 1)), np.tile(thetas[:, None], (1, task.N))
    q, last, _ = continuation_study(task).tracks(begins, speeds)
    done = q[last == task.N]
    if not len(done):
        return -np.inf
    found = survivals(task, done, 2, weights)
    return float(np.where(found.legal, found.coverage, found.coverage - 1.0).max())


def _finalists(case: PlanCase, starts: FloatArray, thetas: FloatArray) -> FloatArray:
    """The starts with the best constant speeds, as far as a coarse grid shows."""
    some = starts[np.unique(np.linspace(0, len(starts) - 1, STARTS).round().astype(np.int64))]
    coarse, scores = case.task.coarse(COARSE), np.empty(len(some))
    for k, start in enumerate(some):
        scores[k] = start_rating(coarse, start, thetas, case.weights)
        case.notify(k + 1, len(some), "starts")
    return np.asarray(some[np.argsort(-scores, kind="stable")[:FINALISTS]])


def _tracks(task: TaskPath, starts: FloatArray, thetas: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Motions that follow the path to its end, (P, N + 1, nv), and which of the starts they have."""
    q, last, _ = continuation_study(task).tracks(starts, np.tile(thetas[:, None], (1, task.N)))
    done = last == task.N
    if not done.any():
        raise InputError(
            f"with no speed of the self-motion {task.robot.name} follows the path beyond sample "
            f"{last.max()} (t = {task.t[last.max()]:g} s); expected a path inside the workspace, or another "
            "start"
        )
    return q[done], np.asarray(done)


def _best(case: PlanCase, q: FloatArray, starts: FloatArray, thetas: FloatArray) -> int:
    """Index of the best of some motions."""
    task, settings = case.task, case.settings
    limits = task.robot.limits
    speed = np.abs(np.diff(q, axis=1)).max(axis=1) / task.dt
    legal = ((q >= limits.q_min) & (q <= limits.q_max)).all(axis=(1, 2)) & (speed <= limits.v_max).all(axis=1)
    energy = (np.diff(q, axis=1) ** 2).sum(axis=(1, 2)) / task.dt
    candidates = np.flatnonzero(legal) if legal.any() else np.arange(len(q))
    if settings.select == "energy":
        regular = np.array([bool(_keeps_signs(case.study, q[k])) for k in candidates])
        kept = candidates[regular] if regular.any() else candidates
        return int(kept[np.argsort(energy[kept], kind="stable")][0])
    coverage, count = np.zeros(len(candidates)), len(candidates)

    def rated(items: Sequence[int]) -> FloatArray:
        some = candidates[list(items)]
        motions, _ = _tracks(task, starts[some], thetas[some])
        return survivals(task, motions, settings.stride, case.weights).coverage

    try:
        for k, coverage[k] in enumerate(in_parts(rated, count)):
            case.notify(k + 1, count, "speeds")
    except KeyboardInterrupt:
        if not coverage.any():
            raise
    return int(candidates[np.lexsort((energy[candidates], -coverage))][0])


def _keeps_signs(study: GoalStudy, q: FloatArray) -> BoolArray:
    """Whether no component of the null vector gets to zero or changes its sign along a motion."""
    null = null_vectors(study, q)
    moves = np.abs(null).max(axis=0) > VANISHED
    return np.asarray(
        (np.abs(null[:, moves]) > 0.0).all() and (np.sign(null[:, moves]) == np.sign(null[0, moves])).all()
    )


def null_vectors(study: GoalStudy, q: FloatArray) -> FloatArray:
    """Unit null vectors n with det [n; A] > 0, (k, nv), of an arm with one joint to spare."""
    return null_vector(study.limited.values(q)[1])
