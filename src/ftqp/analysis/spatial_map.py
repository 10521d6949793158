"""A map of the workspace of any arm: lines of the tip to a goal, and failures on them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, final, get_args

import numpy as np

from ftqp.analysis.circular_intervals import CircularIntervals
from ftqp.analysis.goals import goal_study
from ftqp.analysis.manifolds.joint_ranges import ranges_of
from ftqp.analysis.measures import measures_of
from ftqp.analysis.outcomes.weights import weights_inverse
from ftqp.analysis.planar_links import spread_evenly
from ftqp.core.checks import BoolArray, FloatArray, frozen, instance
from ftqp.core.errors import InputError
from ftqp.kernel.entry.law_study import LawStudy
from ftqp.kernel.layout.endings import CORRECT, UNRESOLVED
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.model.robot import Robot

Plane = Literal["xy", "xz", "yz"]

MOST_POINTS, MOST_PARTS = 4_000_000, 100_000
"""Nodes that a grid has at most, and configurations at a point and parts of a line."""
WHOLE_CIRCLE = 10.0
"""The margin of a joint that no value takes out of range [rad]."""
EDGE = -1e-9
"""A margin from here on counts as inside [rad]."""
SOLVED = 1e-9
"""A configuration so near a pose is at it [unit lengths]."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpatialTask:
    """Everything of a map of an arm in space that does not depend on the point; it can be pickled.

    Attributes:
        joints: Names of the joints.
        robot: The arm.
        rows: Names of the task rows.
        pose: The goal, (4, 4); the tip has its orientation on all of a line, where rotation counts.
        goal: Its position, (3,) [m].
        M: The inverse of the weights, (n, n).
        grid: Nodes of the grid along each axis.
        plane: Two of x, y and z that span a plane through the goal; None fills all of the space.
        configurations: At each point, from so many quasi-random starts.
        steps: Equal parts of a line.
        instants: Nodes of each line at which failures are simulated.
        ranges: For each joint the values with which the goal stays within reach.
        seed: Moves the quasi-random starts.
    """

    joints: tuple[str, ...]
    robot: Robot
    rows: tuple[str, ...]
    pose: FloatArray
    goal: FloatArray
    M: FloatArray
    grid: int
    plane: str | None
    configurations: int
    steps: int
    instants: int
    ranges: tuple[CircularIntervals, ...]
    seed: int

    @property
    def unit(self) -> float:
        """The mean length of a link [m]."""
        return 6.0 * self.robot.length / self.robot.nv


def spatial_task(
    robot: Robot,
    goal: Any,
    rows: Any,
    *,
    grid: int = 12,
    configurations: int = 50,
    steps: int = 100,
    plane: Plane | None = "xz",
    instants: int = 4,
    W: Any = None,
    seed: int = 0,
) -> SpatialTask:
    """What all points of a map of an arm in space share.

    Args:
        robot: The arm.
        goal: A point, (3,) [m], or a pose, (4, 4).
        rows: ``"position"``, ``"pose"``, or names of task rows.
        grid: Nodes along each axis, >= 2.
        configurations: Quasi-random starts at each point, >= 1.
        steps: Equal parts of a line, >= 1.
        plane: The plane through the goal that is mapped; None maps all of the space.
        instants: At how many nodes of a line failures are simulated, >= 1.
        W: Weights of the joint rates, (nv, nv) or its diagonal (nv,), positive definite; None is the
            identity.
        seed: Moves the quasi-random starts.

    Raises:
        InputError: The goal does not fit the rows or is out of reach, W is not positive definite, or a number
            is out of its range.
    """
    instance("robot", robot, Robot, "a Robot")
    finest = MOST_POINTS ** (1.0 / 3.0) if plane is None else MOST_POINTS**0.5
    whole_number("grid", grid, 2, int(finest))
    for name, value in (("configurations", configurations), ("steps", steps), ("instants", instants)):
        whole_number(name, value, 1, MOST_PARTS)
    if plane is not None and plane not in get_args(Plane):
        raise InputError(f"plane is {plane!r}, expected 'xy', 'xz' or 'yz', or None for all of the space")
    M = weights_inverse(W, robot.nv)
    study = goal_study(robot, goal, rows)
    found = ranges_of(study)
    return SpatialTask(
        joints=robot.joints, robot=robot, rows=study.rows, pose=frozen(study.pose.copy()),
        goal=frozen(study.pose[:3, 3].copy()), M=frozen(M), grid=int(grid), plane=plane,
        configurations=int(configurations), steps=int(steps), instants=min(int(instants), int(steps)),
        ranges=tuple(found[joint] for joint in robot.joints), seed=seed,
    )  # fmt: skip


def whole_number(name: str, value: Any, least: int, most: int | None = None) -> None:
    """Refuses what is no whole number from a least one to a largest one.

    Args:
        name: How the user knows it.
        value: What was given.
        least: The least that will do.
        most: The largest that will do; None is any.

    Raises:
        InputError: It is another one.
    """
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not whole or value < least or (most is not None and value > most):
        to = "" if most is None else f" to {most}"
        raise InputError(f"{name} is {value!r:.40}, expected a whole number from {least}{to}")


def spatial_points(task: SpatialTask) -> FloatArray:
    """The points of the map, (P, 3) [m]: nodes of a grid as wide as the reach about the first joint."""
    reach, centre = 6.0 * task.robot.length, task.robot.chain.translation[0]
    axis = np.linspace(-reach, reach, task.grid)
    moving = [k for k in range(3) if task.plane is None or "xyz"[k] in task.plane]
    nodes = np.stack(np.meshgrid(*[axis] * len(moving), indexing="ij"), axis=-1).reshape(-1, len(moving))
    places = np.tile(task.goal, (len(nodes), 1))
    places[:, moving] = nodes + centre[moving]
    return np.asarray(places[np.linalg.norm(places - centre, axis=1) <= reach * (1.0 + 1e-9)])


def spatial_chunk(task: SpatialTask, some: FloatArray) -> list[dict[str, Any]]:
    """The measures and counts of some points.

    Args:
        task: What all points share.
        some: Points, (P, 3) [m].
    """
    study = goal_study(task.robot, task.pose, list(task.rows))
    law = LawStudy(study.free, task.M, task.unit)
    limits = task.robot.limits
    starts = spread_evenly(task.configurations, len(task.joints), task.seed)
    ends = np.isfinite(limits.q_min) & np.isfinite(limits.q_max)
    share = (starts[:, ends] + np.pi) / (2.0 * np.pi)
    starts[:, ends] = limits.q_min[ends] + share * (limits.q_max - limits.q_min)[ends]
    return [_point(task, study.limited, law, starts, point) for point in some]


def _point(
    task: SpatialTask, session: Any, law: LawStudy, starts: FloatArray, point: FloatArray
) -> dict[str, Any]:
    """Those of one point."""
    begin = task.pose.copy()
    begin[:3, 3] = point
    solved, left, _ = session.solutions(starts, goals=begin[None], bounded=True)
    q0 = solved[left < SOLVED * task.unit]
    poses = np.tile(task.pose, (task.steps + 1, 1, 1))
    poses[:, :3, 3] = np.linspace(point, task.goal, task.steps + 1)
    way = np.concatenate([(task.goal - point) / task.steps, np.zeros(3)])
    q, done = law.lines(q0, poses, way[[COMPONENTS.index(row) for row in task.rows]])
    good = done == task.steps
    q = q[good]
    margins = _margins(q, task.ranges)
    R = 1.0 - share_outside(margins).mean(axis=1)
    F, runs, unresolved = _after_failures(task, law, q, margins >= EDGE)
    counts = {"configurations": len(q0), "failed": int((~good).sum()), "runs": runs, "unresolved": unresolved}
    return {**measures_of(R, F), **counts}


def _margins(q: FloatArray, ranges: Sequence[CircularIntervals]) -> FloatArray:
    """How far each joint is inside its range, the least of all last, (C, K + 1, n + 1) [rad or m]."""
    each = [interval.margin(q[:, :, i]) for i, interval in enumerate(ranges)]
    margins = np.stack([*each, np.min(each, axis=0)], axis=2)
    return np.asarray(np.clip(margins, -WHOLE_CIRCLE, WHOLE_CIRCLE))


def share_outside(margins: FloatArray) -> FloatArray:
    """The share of each part of a line that is outside, margins being linear between nodes.

    Args:
        margins: (C, K + 1, n + 1), negative outside.

    Returns:
        (C, K, n + 1), 0 to 1.
    """
    before, now = margins[:, :-1], margins[:, 1:]
    inside, after = before >= EDGE, now >= EDGE
    with np.errstate(invalid="ignore", divide="ignore"):
        crossing = np.clip(before / (before - now), 0.0, 1.0)
    return np.where(inside & after, 0.0, np.where(inside, 1.0 - crossing, np.where(after, crossing, 1.0)))


def _after_failures(
    task: SpatialTask, law: LawStudy, q: FloatArray, within: BoolArray
) -> tuple[FloatArray, int, int]:
    """F of each line from failures at some of its nodes, (C, n + 1); how many ran, and came to no verdict."""
    n = len(task.joints)
    nodes = ((np.arange(task.instants) + 0.5) * task.steps / task.instants).astype(np.int64)
    asked = within[:, nodes]
    line, node, joint = np.nonzero(asked[:, :, :n])
    endings, _, _ = law.runs(q[:, nodes][line, node], joint)
    ok = np.ones(asked.shape, dtype=np.bool_)
    ok[line, node, joint] = endings == CORRECT
    ok[:, :, n] = ok[:, :, :n].all(axis=2)
    with np.errstate(invalid="ignore", divide="ignore"):
        F = (asked & ok).sum(axis=1) / asked.sum(axis=1)
    return np.asarray(F), len(endings), int((endings == UNRESOLVED).sum())
