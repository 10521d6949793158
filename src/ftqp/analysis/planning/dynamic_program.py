"""The plan that survives most on a grid of nodes: dynamic programming over configurations at waypoints."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation, Slerp

from ftqp.analysis.circular_intervals import TURN, wrapped
from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.planning.nodes import curve_nodes, sampled_nodes
from ftqp.analysis.planning.plan_case import PlanCase, speeds
from ftqp.analysis.planning.survival_labels import node_labels, unreached
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.analysis.survival.way_round import DT, way_round
from ftqp.core.checks import BoolArray, FloatArray, IntArray
from ftqp.core.errors import InputError


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ways:
    """What it costs to go on from each node, and where to."""

    # Cost from each node to the end, one array (M,) a waypoint; inf where no way leads there
    values: list[FloatArray]
    # The best node of the next waypoint, (M,), -1 where there is none; none for the last
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
) -> tuple[int, IntArray]:
    """The last waypoint that any way from the starts gets to, and its nodes that one gets to."""
    at = np.flatnonzero(starts)
    for k in range(len(nodes) - 1):
        if not len(at) or not len(nodes[k + 1]):
            return k, at
        ahead = np.unique(_pairs(nodes[k][at], nodes[k + 1], reach, turning)[1])
        if not len(ahead):
            return k, at
        at = ahead
    return len(nodes) - 1, at


LEAST_MARGIN = 0.01
"""A node nearer to a limit counts as if no joint could be missed there [rad or m]."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GridPlan:
    """A way through nodes."""

    q: FloatArray  # Configurations at the waypoints, unwrapped, (K + 1, nv) [rad or m]
    coverage: float  # Share of pairs of joint and waypoint that they survive, each with its joint's weight
    bound: FloatArray  # How many joints the best node of each waypoint can miss, (K,)
    nodes: int  # How many nodes there were


def grid_plan(case: PlanCase) -> GridPlan:
    """The way through nodes of all waypoints that survives most.

    A lock's survival depends on the joint, the waypoint and the configuration alone, so coverage is a sum
    over nodes, and Bellman's recursion finds the best way on the grid.
    Some samples become waypoints. With one joint to spare locks are followed from waypoint to waypoint, with
    more on all samples, for a QP goes one straight step.
    Source: docs/theory/fault-tolerant-plans.md, "The recursion".
    """
    study, fine, q0, settings = case.study, case.task, case.start, case.settings
    task = waypoint_task(fine, settings.waypoints)
    farthest = settings.share * speeds(study.robot)
    nodes = _nodes(case, task, farthest)
    for k, found in enumerate(nodes):
        if not len(found):
            raise unreached(study, fine, round(task.t[k] / fine.dt))
    on = task if study.redundancy == 1 else fine
    survives = node_labels(case, on, on.N // task.N, nodes)
    costs = _costs(case, nodes, survives)
    dt, turning = np.full(task.N, task.dt), study.turning
    ways = best_ways(nodes, costs, dt, farthest=farthest, energy=settings.energy, turning=turning)
    first = 0 if q0 is not None else int(np.argmin(ways.values[0]))
    if not np.isfinite(ways.values[0][first]):
        starts = np.arange(len(nodes[0])) == 0 if q0 is not None else np.ones(len(nodes[0]), dtype=np.bool_)
        last, at = farthest_waypoint(nodes, starts, task.dt * farthest, study.turning)
        remedies = [
            *(["raise share"] if settings.share < 1.0 else []),
            "give the path more time",
            "start elsewhere" if q0 is not None else "take another seed",
        ]
        raise InputError(
            f"no way along the path is found beyond t = {task.t[last]:g} s that joints of {study.robot.name} "
            f"follow at {settings.share:g} of their speed; {', '.join(remedies[:-1])}, or {remedies[-1]}"
            + _round(task, last, nodes, at, ways)
        )
    way = ways.from_node(first)
    kept = [survives[k][way[k]] for k in range(task.N)]
    return GridPlan(
        q=_unwrapped(study, np.array([nodes[k][a] for k, a in enumerate(way)]), q0),
        coverage=float(np.mean(kept * case.weights)),
        bound=np.array([labels.sum(axis=1).max() for labels in survives], dtype=np.float64),
        nodes=sum(len(found) for found in nodes),
    )


MOST_GOALS = 32
"""So many postures behind a gap are looked for a way to, the nearest ones. A guess."""


def _round(task: TaskPath, last: int, nodes: Sequence[FloatArray], at: IntArray, ways: Ways) -> str:
    """Whether joints could come to a posture there from which the path goes on, off the path, in words."""
    ahead = nodes[last][np.isfinite(ways.values[last])]
    if not len(ahead) or not len(at):
        return ""
    start = nodes[last][at[0]]
    goals = ahead[np.argsort(np.abs(ahead - start).max(axis=1), kind="stable")[:MOST_GOALS]]
    motion, looked = way_round(task, start, goals=goals)
    if motion is None:
        return f"; off the path {looked}"
    return (
        f"; off the path a way round of {DT * len(motion):.1f} s leads on: part the path at "
        f"t = {task.t[last]:g} s, plan both parts, and go from one to the other, ftqp.GoTo(planner, q=...)"
    )


def waypoint_task(fine: TaskPath, wanted: int) -> TaskPath:
    """A task on some of the samples, or, where these divide badly, on poses between them."""
    coarse = fine.coarse(wanted)
    if fine.redundancy > 1 or 2 * wanted >= coarse.N:
        return coarse
    t = np.linspace(fine.t[0], fine.t[-1], wanted + 1)
    goals = np.tile(np.eye(4), (len(t), 1, 1))
    goals[:, :3, 3] = np.stack([np.interp(t, fine.t, p) for p in fine.goals[:, :3, 3].T], axis=1)
    goals[:, :3, :3] = Slerp(fine.t, Rotation.from_matrix(fine.goals[:, :3, :3]))(t).as_matrix()
    return fine.through(goals, float(t[1] - t[0]))


def _nodes(case: PlanCase, task: TaskPath, farthest: FloatArray) -> list[FloatArray]:
    """Nodes of all waypoints, by the number of joints to spare."""

    def tell(k: int) -> None:
        case.notify(k, task.N + 1, "nodes")

    study, settings = case.study, case.settings
    common: dict[str, Any] = {"seed": case.seed, "q0": case.start, "notify": tell}
    if study.redundancy == 1:
        nodes = curve_nodes(study, task.goals, spacing=settings.spacing, **common)
    else:
        reach = farthest * task.dt
        nodes = sampled_nodes(study, task.goals, count=settings.nodes, reach=reach, **common)
    return [q[task.clear(q)] for q in nodes]


def _costs(case: PlanCase, nodes: Sequence[FloatArray], survives: Sequence[BoolArray]) -> list[FloatArray]:
    """What it costs to be at each node: the weighted share of coverage lost there, and the margin's share."""
    K, nv = len(survives), case.study.robot.nv
    costs = []
    for k, q in enumerate(nodes):
        distance, middle = _openness(case.study, q)
        lost = (~survives[k] * case.weights).sum(axis=1) / nv if k < K else np.zeros(len(q))
        lost = np.where(distance < LEAST_MARGIN, 1.0, lost)
        costs.append((lost + case.settings.margin * (1.0 - middle)) / K)
    return costs


def _openness(study: GoalStudy, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The distance to the nearest limit, (M,) [rad or m], and the least share of half a range, 0 to 1."""
    limits = study.robot.limits
    room = np.minimum(q - limits.q_min, limits.q_max - q)
    half = 0.5 * (limits.q_max - limits.q_min)
    share = np.where(np.isfinite(half), np.where(np.isfinite(room), room, 0.0) / half, 1.0)
    return room.min(axis=1), np.clip(share.min(axis=1), 0.0, 1.0)


def _unwrapped(study: GoalStudy, q: FloatArray, q0: FloatArray | None) -> FloatArray:
    """Configurations of a way without jumps of whole turns, from the start that was given."""
    way = q.copy()
    start = way[0] if q0 is None else q0
    steps = np.diff(way, axis=0, prepend=start[None])
    steps = np.where(study.turning, wrapped(steps), steps)
    return np.asarray(start + np.cumsum(steps, axis=0))
