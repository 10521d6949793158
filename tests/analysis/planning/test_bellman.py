"""Ways through nodes, against every way there is."""

from itertools import product

import numpy as np

from ftqp.analysis.planning.dynamic_program import best_ways, farthest_waypoint

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


def test_waypoint_behind_which_no_way_leads_is_named() -> None:
    nodes = [np.zeros((1, 1)), np.full((1, 1), 0.5), np.full((1, 1), 5.0)]
    starts, turning = np.array([True]), np.array([False])
    assert farthest_waypoint(nodes, starts, np.ones(1), turning) == 1
    assert farthest_waypoint(nodes, starts, np.full(1, 5.0), turning) == 2
