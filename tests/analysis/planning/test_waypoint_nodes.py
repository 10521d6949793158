"""Nodes of waypoints: all configurations to a spacing, against closed forms."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from ftqp.analysis.planning.nodes import curve_nodes
from ftqp.analysis.planning.plan_case import planning_study
from ftqp.analysis.survival.task_path import task_path
from ftqp.control.paths import Line
from ftqp.model import catalog

SPACING = 0.1
PLANAR = catalog.load("planar", lengths=(1, 1, 1), continuous=True)
Q0 = np.array([-1.524418, 1.260809, 0.741032])


def planar_task(robot=PLANAR):
    start = robot.pose(Q0)
    return task_path(
        robot, Line(start, np.array([0.5, 1.2, 0.0]) - start[:3, 3], duration=10.0), dt=0.5, rows="position"
    )


def closed_form(point: np.ndarray) -> np.ndarray:
    """Configurations of three unit links at a point: all tool angles, both elbows, [0, 2 pi)."""
    angles = np.linspace(0.0, 2 * np.pi, 720, endpoint=False)
    wrist = point - np.stack([np.cos(angles), np.sin(angles)], axis=1)
    cosine = (np.einsum("ki,ki->k", wrist, wrist) - 2.0) / 2.0
    reached = np.abs(cosine) < 1.0
    found = []
    for elbow in (1.0, -1.0):
        q2 = elbow * np.arccos(cosine[reached])
        q1 = np.arctan2(wrist[reached, 1], wrist[reached, 0]) - np.arctan2(np.sin(q2), 1.0 + np.cos(q2))
        found.append(np.stack([q1, q2, angles[reached] - q1 - q2], axis=1))
    return np.mod(np.vstack(found), 2 * np.pi)


def test_every_configuration_of_the_closed_form_is_near_a_node() -> None:
    task = planar_task()
    nodes = curve_nodes(planning_study(task, SPACING), task.goals, spacing=SPACING, seed=0)
    for goal, q in zip(task.goals, nodes, strict=True):
        tree = cKDTree(q, boxsize=2 * np.pi)
        away, _ = tree.query(closed_form(goal[:2, 3]))
        assert away.max() < SPACING


def test_nodes_are_at_their_goals_and_within_limits() -> None:
    for robot, rows in ((catalog.load("panda"), "pose"), (catalog.load("zhang7"), "pose")):
        path = Line(robot.pose(robot.neutral), 0.05 * robot.length * np.ones(3), duration=1.0)
        task = task_path(robot, path, dt=0.5, rows=rows, q0=robot.neutral)
        nodes = curve_nodes(
            planning_study(task, SPACING), task.goals, spacing=SPACING, seed=1, q0=robot.neutral
        )
        assert np.array_equal(nodes[0][0], robot.neutral)
        for goal, q in zip(task.goals, nodes, strict=True):
            assert len(q) > 10
            assert (q >= robot.limits.q_min - 1e-9).all() and (q <= robot.limits.q_max + 1e-9).all()
            assert max(np.abs(robot.pose(one) - goal).max() for one in q[::5]) < 1e-9


def test_nodes_do_not_depend_on_the_seed_but_for_where_curves_begin() -> None:
    task = planar_task()
    one, other = (
        curve_nodes(planning_study(task, SPACING), task.goals[:3], spacing=SPACING, seed=seed)
        for seed in (0, 5)
    )
    again = curve_nodes(planning_study(task, SPACING), task.goals[:3], spacing=SPACING, seed=0)
    for a, b, c in zip(one, other, again, strict=True):
        assert np.array_equal(a, c)
        away, _ = cKDTree(a, boxsize=2 * np.pi).query(b)
        assert away.max() < SPACING


def test_pose_outside_the_workspace_has_no_node() -> None:
    task = planar_task()
    far = np.eye(4)
    far[0, 3] = 3.5
    assert len(curve_nodes(planning_study(task, SPACING), far[None], spacing=SPACING, seed=0)[0]) == 0


def test_spacing_is_kept_along_curves() -> None:
    task = planar_task()
    nodes = curve_nodes(planning_study(task, SPACING), task.goals[:1], spacing=SPACING, seed=0)[0]
    away, _ = cKDTree(nodes, boxsize=2 * np.pi).query(nodes, k=2)
    assert np.median(away[:, 1]) == pytest.approx(SPACING, rel=0.2)
