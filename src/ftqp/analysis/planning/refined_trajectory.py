"""Trajectories on the samples of a task from configurations at its waypoints."""

from collections.abc import Iterator
from typing import Final

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter1d

from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.core.checks import FloatArray

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

    Args:
        study: Of the arm and the task rows.
        task: On the samples that are wanted.
        waypoints: Configurations at even times, (K + 1, nv) [rad or m].
    """
    for width in sorted(WIDTHS, reverse=True):
        q = _between(_averaged(waypoints, width), task.t)
        exact, left = onto_path(study, task, q)
        if left <= study.tolerance:
            yield width, exact


def onto_path(study: GoalStudy, task: TaskPath, q: FloatArray) -> tuple[FloatArray, float]:
    """Configurations near a path brought onto it, (N + 1, nv), and the largest error left [m].

    Args:
        study: Of the arm and the task rows.
        task: The path.
        q: A configuration for each sample, (N + 1, nv) [rad or m].
    """
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
