"""Ways through nodes, against every way there is."""

from itertools import product

import numpy as np
from scipy.spatial import cKDTree
from tests.analysis.planar_arms import PATH, UNIT

from ftqp.analysis.planning.dynamic_program import best_ways
from ftqp.analysis.planning.nodes import curve_nodes
from ftqp.analysis.planning.plan_case import planning_study
from ftqp.analysis.survival.task_path import task_path
from ftqp.control.paths import Line
from ftqp.model import catalog

DT = np.full(3, 0.5)
REACH = np.array([1.2, 0.8])


def layers(seed: int) -> tuple[list[np.ndarray], list[np.ndarray]]:
    random = np.random.default_rng(seed)
    nodes = [random.uniform(0.0, 2.0, (count, 2)) for count in (4, 6, 5, 3)]
    return nodes, [random.uniform(0.0, 1.0, len(q)) for q in nodes]


def price(nodes, costs, way, turning, energy=0.3):
    """What a way costs, or infinity where a joint is too fast."""
    total = sum(cost[a] for cost, a in zip(costs, way, strict=True))
    for k in range(len(way) - 1):
        step = nodes[k + 1][way[k + 1]] - nodes[k][way[k]]
        step = np.where(turning, (step + np.pi) % (2 * np.pi) - np.pi, step)
        if (np.abs(step) > REACH * DT[k]).any():
            return np.inf
        total += energy * step @ step / DT[k]
    return total


def test_value_of_every_node_is_that_of_the_cheapest_of_all_ways() -> None:
    for seed, turning in (
        (0, np.array([False, False])),
        (1, np.array([True, False])),
        (2, np.array([True, True])),
    ):
        nodes, costs = layers(seed)
        nodes = [np.where(turning, (q - 1.0) % (2 * np.pi), q) for q in nodes]
        ways = best_ways(nodes, costs, DT, farthest=REACH, energy=0.3, turning=turning)
        for first in range(len(nodes[0])):
            rest = product(*(range(len(q)) for q in nodes[1:]))
            best = min(price(nodes, costs, (first, *way), turning) for way in rest)
            assert np.isclose(ways.values[0][first], best) or (
                np.isinf(best) and np.isinf(ways.values[0][first])
            )
            if np.isfinite(best):
                assert np.isclose(price(nodes, costs, ways.from_node(first), turning), best)


def test_joint_that_reaches_all_the_way_round_parts_no_nodes() -> None:
    nodes = [np.array([[0.1]]), np.array([[3.0]])]
    costs = [np.zeros(1), np.zeros(1)]
    for farthest, finite in ((7.0, True), (2.0, False)):
        ways = best_ways(
            nodes, costs, np.ones(1), farthest=np.array([farthest]), energy=0.0, turning=np.array([True])
        )
        assert np.isfinite(ways.values[0][0]) == finite


SPACING = 0.1


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
    task = task_path(UNIT, PATH, dt=0.5, rows="position")
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
