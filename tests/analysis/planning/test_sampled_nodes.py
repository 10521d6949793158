"""Nodes of arms with two or more joints to spare."""

from itertools import pairwise

import numpy as np

from ftqp.analysis.planning.nodes import sampled_nodes
from ftqp.analysis.planning.plan_case import planning_study
from ftqp.analysis.survival.task_path import task_path
from ftqp.control.paths import Line
from ftqp.model import catalog

ARM = catalog.load("planar", count=4)
TASK = task_path(ARM, Line(ARM.pose(ARM.neutral), (-0.2, -1.2, 0.0), duration=4.0), dt=0.2, rows="position")
REACH = np.full(4, 0.1)


def nodes_of(seed: int, q0=None):
    return sampled_nodes(planning_study(TASK, 0.1), TASK.goals, count=64, reach=REACH, seed=seed, q0=q0)


def test_nodes_are_at_their_goals_within_limits() -> None:
    for goal, q in zip(TASK.goals, nodes_of(0), strict=True):
        assert len(q) == 64
        assert (q >= ARM.limits.q_min).all() and (q <= ARM.limits.q_max).all()
        assert max(np.abs(ARM.pose(one)[:2, 3] - goal[:2, 3]).max() for one in q) < 1e-9


def test_most_nodes_are_reached_from_the_waypoint_before_and_spread_out() -> None:
    nodes = nodes_of(0, ARM.neutral)
    steps = [np.abs(b[:, None] - a).max(axis=2).min(axis=1) for a, b in pairwise(nodes)]
    assert np.mean(np.concatenate(steps) <= 2.0 * REACH[0]) > 0.8
    assert np.array_equal(nodes[0][0], ARM.neutral) and np.ptp(nodes[-1], axis=0).max() > 1.0
