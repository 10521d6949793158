"""Why a path has no plan: a sample is out of reach or outside the limits, or no trajectory keeps them."""

import numpy as np

from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.survival.coverage_case import FOLLOWED
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError

OUTSIDE = 1e-9
"""A configuration farther outside a limit counts as outside [rad or m]."""
STARTS = 512
"""Starts from which the sample is tried without limits."""


def unreached(study: GoalStudy, task: TaskPath, k: int) -> InputError:
    """The error of a sample at which no configuration within the limits is found."""
    robot, limits = study.robot, study.robot.limits
    study.limited.aim(task.goals[k])
    q, left, _ = study.limited.solutions(study.starts(STARTS))
    where = f"sample {k} of the path (t = {task.t[k]:g} s)"
    reached = q[left <= study.tolerance]
    inside = reached[(reached >= limits.q_min).all(axis=1) & (reached <= limits.q_max).all(axis=1)]
    if len(inside) and not task.clear(inside).any():
        return InputError(
            f"{robot.name} comes too near to something at {where}: {1e3 * task.clearances(inside).max():.3g} "
            f"mm at most, expected {1e3 * _keep(task):g} mm; move the path or what stands there"
        )
    if not len(reached):
        return InputError(
            f"{robot.name} does not reach {where}, being {left.min():.3g} m off at least; expected a path "
            "inside the workspace"
        )
    beyond = np.maximum(limits.q_min - reached, reached - limits.q_max)
    best = beyond[np.argmin(beyond.max(axis=1))]
    i = int(np.argmax(best))
    return InputError(
        f"{robot.name} reaches {where} outside its limits only, {robot.joints[i]!r} being "
        f"{max(best[i], 0.0):.3g} rad or m beyond at least; expected a path within the limits"
    )


def refuse_near(task: TaskPath, q: FloatArray, which: str) -> None:
    """Refuses postures in which the arm is nearer to something than it is to keep."""
    far = task.clearances(q)
    k = int(far.argmin())
    if task.around is not None and far[k] < _keep(task) - OUTSIDE:
        at = "" if len(q) == 1 else f" at sample {k}"
        raise InputError(
            f"{which} comes too near to something{at}: {1e3 * far[k]:.3g} mm, expected at least "
            f"{1e3 * _keep(task):g} mm; start elsewhere, move the path, or ask for less, "
            "ftqp.Clearance(keep=...)"
        )


def _keep(task: TaskPath) -> float:
    return 0.0 if task.around is None else task.around.clearance.keep


def refuse_illegal(task: TaskPath, q: FloatArray, method: str) -> None:
    """Refuses a trajectory with a joint beyond its limits of position or speed."""
    robot, limits = task.robot, task.robot.limits
    beyond = np.maximum(limits.q_min - q, q - limits.q_max)
    hurry = np.abs(np.diff(q, axis=0)) / (task.dt * limits.v_max)
    for excess, least, told in (
        (beyond, OUTSIDE, "{:.3g} rad or m outside its position limits"),
        (hurry, 1.0 + OUTSIDE, "at {:.3g} times its speed limit"),
    ):
        if excess.max() > least:
            k, i = np.unravel_index(int(excess.argmax()), excess.shape)
            other = "" if method == "dp" else "take 'dp', "
            raise InputError(
                f"with the method {method!r} no plan keeps all limits: {robot.joints[i]!r} would be "
                f"{told.format(excess[k, i])} at sample {k} (t = {task.t[k]:g} s); {other}start "
                "elsewhere or give the path more time"
            )
    if not np.all(task.clearances(q) >= _keep(task) - FOLLOWED[0]):
        refuse_near(task, q, f"the plan by the method {method!r}")
