"""Plans by the speed of the self-motion: one speed for all of a path, a spline over time, or a gradient."""

from contextlib import suppress
from dataclasses import dataclass
from typing import final

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import minimize

from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.planning.plan_settings import PlanSettings, Told
from ftqp.analysis.planning.survival_labels import survivals
from ftqp.analysis.survival.continuing import continuation_study
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.analysis.tolerance.null_vectors import null_vector
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


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpeedPlan:
    """A trajectory and the speed of its self-motion.

    Attributes:
        q: Configurations on the samples, (N + 1, nv) [rad or m].
        speeds: Of the self-motion between samples, (N,) [rad/s].
    """

    q: FloatArray
    speeds: FloatArray


def constant_plan(
    study: GoalStudy, task: TaskPath, starts: FloatArray, settings: PlanSettings, told: Told
) -> SpeedPlan:
    """The best plan with one speed: q_dot = J^+ (x_dot + K e) + theta n, theta swept.

    Speeds with which the arm leaves its limits are left out, where there are others. By coverage the best is
    taken, of equal ones that with the least energy. The paper's rule takes the least energy of those on which
    no component of n changes its sign, which says nothing of what happens after the lock.
    Source: zhang2016, section 3; docs/theory/fault-tolerant-plans.md, "One speed".

    Args:
        study: Of the arm and the task rows.
        task: The path.
        starts: Where the arm may start, (s, nv) [rad or m].
        settings: The knobs.
        told: Hears of progress.

    Raises:
        InputError: With no speed the path is followed to its end.
    """
    thetas = np.array(settings.thetas)
    if len(starts) > FINALISTS:
        starts = _finalists(study, task, starts, thetas[:: min(TENTH, max(1, len(thetas) // 3))], told)
    q, speeds = _tracks(study, task, np.repeat(starts, len(thetas), axis=0), np.tile(thetas, len(starts)))
    rated = _rated(study, task, q, settings, told)
    best = rated[0]
    return SpeedPlan(q=q[best], speeds=np.full(task.N, speeds[best]))


def spline_plan(
    study: GoalStudy, task: TaskPath, starts: FloatArray, settings: PlanSettings, told: Told
) -> SpeedPlan:
    """The best plan found with a speed that changes over time: a spline through some knots.

    Nelder and Mead's simplex goes down 1 - (survived + completed/2) plus what is beyond the limits, from the
    best constant speed on. Source: docs/theory/fault-tolerant-plans.md, "A spline of speeds".

    Args:
        study: Of the arm and the task rows.
        task: The path.
        starts: Where the arm may start, (s, nv) [rad or m].
        settings: The knobs.
        told: Hears of progress.

    Raises:
        InputError: With no constant speed the path is followed to its end.
    """
    begin = constant_plan(study, task, starts, settings, told)
    coarse = task.coarse(COARSE)
    start = begin.q[0]
    knots = np.linspace(task.t[0], task.t[-1], settings.knots)
    best = np.inf, np.full(settings.knots, begin.speeds[0])
    tried = 0

    def speeds_at(x: FloatArray, t: FloatArray) -> FloatArray:
        curve = PchipInterpolator(knots, x)(t[:-1])
        return np.asarray(np.clip(curve, -settings.fastest, settings.fastest))

    def cost(x: FloatArray) -> float:
        nonlocal tried, best
        tried += 1
        value = loss(x)
        if value < best[0]:
            best = value, x.copy()
        told(min(tried, settings.evaluations), settings.evaluations, "splines")
        return value

    def loss(x: FloatArray) -> float:
        q, last, _ = continuation_study(coarse).tracks(start[None], speeds_at(x, coarse.t)[None])
        if last[0] < coarse.N:
            return 2.0 + OUT_OF_LIMITS - float(last[0]) / coarse.N
        found = survivals(coarse, q, 1)
        beyond = found.excess[0] + max(0.0, found.hurry[0] - 1.0)
        return float(1.0 - found.coverage[0] - 0.5 * found.completed[0] + OUT_OF_LIMITS * beyond)

    first = best[1]
    spread = 0.25 * max(0.2, abs(float(begin.speeds[0])))
    simplex = np.vstack([first, first + spread * np.eye(settings.knots)])
    with suppress(KeyboardInterrupt):
        minimize(
            cost,
            first,
            method="Nelder-Mead",
            options={
                "maxfev": settings.evaluations,
                "initial_simplex": simplex,
                "xatol": 1e-4,
                "fatol": 1e-5,
            },
        )
    speeds = speeds_at(best[1], task.t)
    q, last, _ = continuation_study(task).tracks(start[None], speeds[None])
    if last[0] < task.N:
        return begin
    both = survivals(task, np.stack([begin.q, q[0]]), settings.stride)
    better = (both.legal[1], both.coverage[1]) > (both.legal[0], both.coverage[0])
    return SpeedPlan(q=q[0], speeds=speeds) if better else begin


def _finalists(
    study: GoalStudy, task: TaskPath, starts: FloatArray, thetas: FloatArray, told: Told
) -> FloatArray:
    """The starts with the best constant speeds, as far as a coarse grid shows."""
    some = starts[np.unique(np.linspace(0, len(starts) - 1, STARTS).round().astype(np.int64))]
    coarse = task.coarse(COARSE)
    scores = np.full(len(some), -np.inf)
    for k, start in enumerate(some):
        q, last, _ = continuation_study(coarse).tracks(
            np.tile(start, (len(thetas), 1)), np.tile(thetas[:, None], (1, coarse.N))
        )
        done = q[last == coarse.N]
        if len(done):
            found = survivals(coarse, done, 2)
            scores[k] = np.where(found.legal, found.coverage, found.coverage - 1.0).max()
        told(k + 1, len(some), "starts")
    return np.asarray(some[np.argsort(-scores, kind="stable")[:FINALISTS]])


def _tracks(
    study: GoalStudy, task: TaskPath, starts: FloatArray, thetas: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Motions that follow the path to its end, (P, N + 1, nv), and their speeds, (P,)."""
    q, last, _ = continuation_study(task).tracks(starts, np.tile(thetas[:, None], (1, task.N)))
    done = last == task.N
    if not done.any():
        raise InputError(
            f"with no speed of the self-motion {study.robot.name} follows the path beyond sample "
            f"{last.max()} (t = {task.t[last.max()]:g} s); expected a path inside the workspace, or another "
            "start"
        )
    return q[done], thetas[done]


def _rated(
    study: GoalStudy, task: TaskPath, q: FloatArray, settings: PlanSettings, told: Told
) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Indices of motions, the best first."""
    limits = study.robot.limits
    speed = np.abs(np.diff(q, axis=1)).max(axis=1) / task.dt
    legal = ((q >= limits.q_min) & (q <= limits.q_max)).all(axis=(1, 2)) & (speed <= limits.v_max).all(axis=1)
    energy = (np.diff(q, axis=1) ** 2).sum(axis=(1, 2)) / task.dt
    candidates = np.flatnonzero(legal) if legal.any() else np.arange(len(q))
    if settings.select == "energy":
        regular = np.array([bool(_keeps_signs(study, q[k])) for k in candidates])
        kept = candidates[regular] if regular.any() else candidates
        return np.asarray(kept[np.argsort(energy[kept], kind="stable")])
    coverage = np.zeros(len(candidates))
    try:
        for k, i in enumerate(candidates):
            coverage[k] = survivals(task, q[i][None], settings.stride).coverage[0]
            told(k + 1, len(candidates), "speeds")
    except KeyboardInterrupt:
        if not coverage.any():
            raise
    return np.asarray(candidates[np.lexsort((energy[candidates], -coverage))])


def _keeps_signs(study: GoalStudy, q: FloatArray) -> BoolArray:
    """Whether no component of the null vector gets to zero or changes its sign along a motion."""
    null = null_vectors(study, q)
    moves = np.abs(null).max(axis=0) > VANISHED
    return np.asarray(
        (np.abs(null[:, moves]) > 0.0).all() and (np.sign(null[:, moves]) == np.sign(null[0, moves])).all()
    )


def null_vectors(study: GoalStudy, q: FloatArray) -> FloatArray:
    """Unit null vectors n with det [n; A] > 0, (k, nv), of an arm with one joint to spare.

    Args:
        study: Of the arm and the task rows.
        q: Configurations, (k, nv) [rad or m].
    """
    return null_vector(study.limited.values(q)[1])
