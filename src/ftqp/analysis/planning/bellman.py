"""The cheapest way through the nodes of all waypoints: Bellman's recursion, exact on the nodes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from scipy.spatial import cKDTree

from ftqp.analysis.circular_intervals import TURN, wrapped
from ftqp.core.checks import BoolArray, FloatArray, IntArray


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ways:
    """What it costs to go on from each node, and where to.

    Attributes:
        values: Cost from each node to the end, one array (M,) a waypoint; inf where no way leads there.
        follows: The best node of the next waypoint, (M,), -1 where there is none; none for the last.
    """

    values: list[FloatArray]
    follows: list[IntArray]

    def from_node(self, first: int) -> IntArray:
        """The nodes of the best way from a node of the first waypoint, (K + 1,)."""
        way = [first]
        for follow in self.follows:
            way.append(int(follow[way[-1]]))
        return np.array(way)


def best_ways(
    nodes: Sequence[FloatArray],
    costs: Sequence[FloatArray],
    dt: FloatArray,
    *,
    farthest: FloatArray,
    energy: float,
    turning: BoolArray,
) -> Ways:
    """V_k(a) = c_k(a) + min_b { V_{k+1}(b) + energy |q_b - q_a|^2 / dt_k : |q_b - q_a| <= farthest dt_k }.

    Among equal ones the node that comes first is taken, so that the result is the same every time.
    Source: bellman1957; docs/theory/fault-tolerant-plans.md, "The recursion".
    """
    values, follows = [costs[-1].astype(np.float64)], []
    for k in range(len(nodes) - 2, -1, -1):
        value, follow = _step(nodes[k], nodes[k + 1], values[-1], float(dt[k]), farthest, energy, turning)
        values.append(costs[k] + value)
        follows.append(follow)
    return Ways(values=values[::-1], follows=follows[::-1])


def _step(
    here: FloatArray,
    there: FloatArray,
    ahead: FloatArray,
    dt: float,
    farthest: FloatArray,
    energy: float,
    turning: BoolArray,
) -> tuple[FloatArray, IntArray]:
    """The best continuation of every node of a waypoint: its cost and the node it goes to."""
    value, follow = np.full(len(here), np.inf), np.full(len(here), -1)
    open_ends = np.flatnonzero(np.isfinite(ahead))
    if not len(here) or not len(open_ends):
        return value, follow
    reach = farthest * dt
    a, b = _pairs(here, there[open_ends], reach, turning)
    step = there[open_ends[b]] - here[a]
    step = np.where(turning, wrapped(step), step)
    cost = ahead[open_ends[b]] + energy * (step * step).sum(axis=1) / dt
    order = np.lexsort((open_ends[b], cost, a))
    firsts = order[np.unique(a[order], return_index=True)[1]]
    value[a[firsts]], follow[a[firsts]] = cost[firsts], open_ends[b[firsts]]
    return value, follow


def _pairs(
    here: FloatArray, there: FloatArray, reach: FloatArray, turning: BoolArray
) -> tuple[IntArray, IntArray]:
    """Indices of all pairs with |q_b - q_a| <= reach in every joint."""
    box = np.where(turning, TURN / reach, 0.0)
    trees = [cKDTree(_within(q / reach, box), boxsize=box) for q in (here, there)]
    found = trees[0].sparse_distance_matrix(trees[1], 1.0, p=np.inf, output_type="coo_matrix")
    return found.row.astype(np.int64), found.col.astype(np.int64)


def _within(scaled: FloatArray, box: FloatArray) -> FloatArray:
    """Values of circles strictly below their length, as the tree asks."""
    return np.asarray(np.where((box > 0.0) & (scaled >= box), 0.0, scaled))


def farthest_waypoint(
    nodes: Sequence[FloatArray], starts: BoolArray, reach: FloatArray, turning: BoolArray
) -> int:
    """The last waypoint that any way from the starts gets to."""
    at = np.flatnonzero(starts)
    for k in range(len(nodes) - 1):
        if not len(at) or not len(nodes[k + 1]):
            return k
        ahead = np.unique(_pairs(nodes[k][at], nodes[k + 1], reach, turning)[1])
        if not len(ahead):
            return k
        at = ahead
    return len(nodes) - 1
