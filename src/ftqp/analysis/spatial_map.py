"""A map of the workspace of any arm: lines of the tip to a goal, and failures on them."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, final, get_args

import numpy as np

from ftqp.analysis.circular_intervals import CircularIntervals
from ftqp.analysis.goals import goal_study
from ftqp.analysis.manifolds.joint_ranges import ranges_of
from ftqp.analysis.outcomes.unaware_law import weights_inverse
from ftqp.analysis.planar_links import spread_evenly
from ftqp.core.checks import FloatArray, IntArray, frozen, instance, whole_number
from ftqp.core.errors import InputError
from ftqp.kernel.entry.law_study import Intervals, LawStudy
from ftqp.model.robot import Robot

Plane = Literal["xy", "xz", "yz"]

MOST_POINTS, MOST_PARTS = 4_000_000, 100_000
"""Nodes that a grid has at most, and configurations at a point and parts of a line."""
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

    asks: ClassVar[bool] = True
    suspects: ClassVar[None] = None
    length: ClassVar[str] = "cartesian"
    options: ClassVar[dict[str, float]] = {}

    @property
    def unit(self) -> float:
        """The mean length of a link [m]."""
        return 6.0 * self.robot.length / self.robot.nv

    @property
    def boxes(self) -> list[list[Intervals]]:
        """The one box of the joints' values with which the goal stays within reach."""
        return [[interval.intervals for interval in self.ranges]]

    @property
    def circular(self) -> list[bool]:
        """Whether the values of each joint count modulo one turn."""
        return [interval.circular for interval in self.ranges]

    @property
    def nodes(self) -> IntArray:
        """The nodes of a line at which joints fail."""
        return ((np.arange(self.instants) + 0.5) * self.steps / self.instants).astype(np.int64)

    def study(self) -> LawStudy:
        """Compiled studies of the arm with this goal."""
        return LawStudy(goal_study(self.robot, self.pose, list(self.rows)).free, self.M, self.unit)

    def starts(self, some: FloatArray) -> Iterator[FloatArray]:
        """The configurations at each of some points that are found within the limits, (C, n) [rad or m]."""
        limits, session = self.robot.limits, goal_study(self.robot, self.pose, list(self.rows)).limited
        starts = spread_evenly(self.configurations, len(self.joints), self.seed)
        ends = np.isfinite(limits.q_min) & np.isfinite(limits.q_max)
        share = (starts[:, ends] + np.pi) / (2.0 * np.pi)
        starts[:, ends] = limits.q_min[ends] + share * (limits.q_max - limits.q_min)[ends]
        for point in some.reshape(-1, 3):
            begin = self.pose.copy()
            begin[:3, 3] = point
            solved, left, _ = session.solutions(starts, goals=begin[None], bounded=True)
            yield solved[left < SOLVED * self.unit]


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


def spatial_points(task: SpatialTask) -> FloatArray:
    """The points of the map, (P, 3) [m]: nodes of a grid as wide as the reach about the first joint."""
    reach, centre = 6.0 * task.robot.length, task.robot.chain.translation[0]
    axis = np.linspace(-reach, reach, task.grid)
    moving = [k for k in range(3) if task.plane is None or "xyz"[k] in task.plane]
    nodes = np.stack(np.meshgrid(*[axis] * len(moving), indexing="ij"), axis=-1).reshape(-1, len(moving))
    places = np.tile(task.goal, (len(nodes), 1))
    places[:, moving] = nodes + centre[moving]
    return np.asarray(places[np.linalg.norm(places - centre, axis=1) <= reach * (1.0 + 1e-9)])
