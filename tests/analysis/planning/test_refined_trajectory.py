"""From waypoints to trajectories on all samples."""

import numpy as np
from planar_arms import Q0
from planar_arms import UNIT as ARM

from ftqp.analysis.planning.plan_case import planning_study
from ftqp.analysis.planning.planned import WIDTHS, smooth_trajectories
from ftqp.analysis.survival.continuing import track
from ftqp.analysis.survival.task_path import task_path
from ftqp.control.paths import Line

TASK = task_path(ARM, Line(ARM.pose(Q0), (-0.5, 0.8, 0.0), duration=4.0), dt=0.05, rows="position", q0=Q0)


def test_smoother_trajectories_cost_less_and_all_are_on_the_path_with_both_ends_kept() -> None:
    study = planning_study(TASK, 0.1)
    waypoints = track(TASK, Q0, 0.3 * np.sign(np.sin(8.0 * TASK.t[:-1])))[::4]
    found = list(smooth_trajectories(study, TASK, waypoints))
    assert [width for width, _ in found] == sorted(WIDTHS, reverse=True)
    energies = [np.square(np.diff(q, axis=0)).sum() for _, q in found]
    assert (np.diff(energies) > 0.0).all()
    for width, q in found:
        off = [np.abs(ARM.pose(q[k])[:2, 3] - TASK.goals[k, :2, 3]).max() for k in range(0, TASK.N + 1, 7)]
        assert max(off) < 1e-10
        assert np.allclose(q[0], waypoints[0], atol=1e-12) and np.allclose(q[-1], waypoints[-1], atol=1e-12)
        assert width > 0.0 or np.allclose(q[::4], waypoints, atol=1e-10)
