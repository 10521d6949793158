"""A map of a workspace in pieces: what all its points share, in the plane or in space, and the measures."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Final, Literal, final, get_args

import numpy as np

from ftqp.analysis.circular_intervals import CircularIntervals
from ftqp.analysis.goals import goal_study
from ftqp.analysis.manifolds.joint_ranges import ranges_of
from ftqp.analysis.outcomes.unaware_law import weights_inverse
from ftqp.analysis.planar_links import PlanarLinks, spread_evenly
from ftqp.core.checks import BoolArray, FloatArray, IntArray, array, frozen, instance, whole_number
from ftqp.core.errors import InputError
from ftqp.kernel.entry.law_study import Intervals, LawStudy
from ftqp.kernel.layout.enums import CORRECT, UNRESOLVED
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
        pose: The goal, (4, 4); the end effector has its orientation on all of a line, where rotation counts.
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

    @property
    def unit(self) -> float:
        """The mean length of a link [m]."""
        return 6.0 * self.robot.length / self.robot.nv

    @property
    def box(self) -> list[Intervals]:
        """For each joint the values with which the goal stays within reach."""
        return [interval.intervals for interval in self.ranges]

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
    """What all points of a map of an arm in space share; see ``workspace`` for the arguments.

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


MEASURES: Final = ("R100", "Ravg", "Rsens", "F100", "Favg", "Fsens", "C100", "Cavg")
"""Names of the measures."""
WHOLE: Final = 1.0 - 1e-12
"""A share from here on is all."""


def measures_of(R: FloatArray, F: FloatArray) -> dict[str, FloatArray]:
    """The measures in percent, each (n + 1,); NaN where no configuration says it.

    100: the share of configurations with all of the length. avg: the mean. sens: the largest minus the
    smallest. C = R F is the share of the whole line on which a failure leaves the goal within reach and ends
    there. Source: goel2005, section 4, and docs/theory/after-a-failure.md, "Lines and measures".
    """
    shares = {"R": R, "F": F, "C": R * np.where(np.isnan(F), 0.0, F)}
    found: dict[str, FloatArray] = {}
    for letter, share in shares.items():
        said = ~np.isnan(share)
        count = said.sum(axis=0)
        with np.errstate(invalid="ignore", divide="ignore"):
            found[f"{letter}100"] = 100.0 * ((share >= WHOLE) & said).sum(axis=0) / count
            found[f"{letter}avg"] = 100.0 * np.where(said, share, 0.0).sum(axis=0) / count
        if letter == "C":
            continue
        largest = np.where(said, share, -np.inf).max(axis=0, initial=-np.inf)
        smallest = np.where(said, share, np.inf).min(axis=0, initial=np.inf)
        found[f"{letter}sens"] = np.where(count > 0, 100.0 * (largest - smallest), np.nan)
    return found


CELLS = 720
"""Locked values of a joint that are looked at for ends other than the goal."""
INSET = 0.05
"""Share of a cell from the ends of a range to the values that are looked at there."""
NEAR = 5.0
"""Cells to either side of a value with a miss that are suspects, too: basins shrink before they vanish."""
PROBES = 64
"""Configurations of the other joints that each of them is tried with."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WorkspaceTask:
    """Everything of a map that does not depend on the point; made by ``workspace_task``, can be pickled.

    Attributes:
        joints: Names of the joints.
        links: The arm.
        M: The inverse of the weights, (n, n).
        goal: Where the end effector is to go, (2,) [m].
        grid: Nodes of the grid along each axis.
        configurations: Configurations of each part of a point's self-motion.
        steps: Equal parts of a line to the goal.
        screen: Whether failures at values from which every trial went to the goal are taken as correct.
        box: For each joint the values with which the goal stays within reach [rad].
        suspects: For each joint, locked values from which not every trial went to the goal [rad]; None where
            all failures are simulated.
        seed: Moves quasi-random configurations.
    """

    joints: tuple[str, ...]
    links: PlanarLinks
    M: FloatArray
    goal: FloatArray
    grid: int
    configurations: int
    steps: int
    screen: bool
    box: list[Intervals]
    suspects: list[Intervals] | None
    seed: int

    circular: ClassVar[bool] = True

    def study(self) -> LawStudy:
        """Compiled studies of the arm with this goal."""
        return self.links.study(self.M, self.links.local(self.goal))

    @property
    def asks(self) -> bool:
        """Whether there are failures to simulate."""
        return self.suspects is None or any(self.suspects)

    @property
    def nodes(self) -> IntArray:
        """The nodes of a line at which joints fail."""
        return np.arange(self.steps + 1)

    def starts(self, some: FloatArray) -> Iterator[FloatArray]:
        """The configurations at each of some points, (C, n) [rad]."""
        for point in some.reshape(-1, 2):
            parts = self.links.configurations(self.links.local(point), self.configurations, self.seed)
            yield np.concatenate([np.empty((0, len(self.joints))), *parts])


def workspace_task(
    robot: Robot,
    goal: Any,
    *,
    grid: int = 52,
    configurations: int = 90,
    steps: int = 100,
    screen: bool = True,
    W: Any = None,
    seed: int = 0,
) -> WorkspaceTask:
    """What all points of the map of a planar arm share; see ``workspace`` for the arguments.

    Raises:
        InputError: The goal is out of reach, W is not positive definite, a number is not positive, or the arm
            is not a planar one.
    """
    instance("robot", robot, Robot, "a Robot")
    whole_number("grid", grid, 2, int(MOST_POINTS**0.5))
    for name, value in (("configurations", configurations), ("steps", steps)):
        whole_number(name, value, 1, MOST_PARTS)
    M = weights_inverse(W, robot.nv)
    links = PlanarLinks.of(robot)
    if links is None:
        raise InputError(
            f"{robot.name} is not a planar arm of revolute joints; for a map of an arm in space give rows to "
            'ftqp.analysis.workspace, for example rows="position"'
        )
    point = array(
        "goal", np.asarray(goal, dtype=np.float64)[:2] if np.size(goal) == 3 else goal, (2,), "(2,)"
    )
    distance = float(np.hypot(*(point - links.base)))
    if not links.inner() <= distance < links.reach:
        raise InputError(
            f"goal {point.tolist()} is {distance:.4g} m from joint 1, expected between {links.inner():.4g} "
            f"and {links.reach:.4g} m; choose a goal inside the workspace"
        )
    task = WorkspaceTask(
        joints=robot.joints, links=links, M=frozen(M), goal=frozen(point), grid=int(grid),
        configurations=int(configurations), steps=int(steps), screen=bool(screen),
        box=links.ranges(links.local(point)), suspects=None, seed=seed,
    )  # fmt: skip
    return replace(task, suspects=_suspects(task)) if screen else task


def points(task: WorkspaceTask | SpatialTask) -> FloatArray:
    """The points of the map, (P, 2) or (P, 3) [m]: nodes of a square grid as wide as the reach."""
    if isinstance(task, SpatialTask):
        return spatial_points(task)
    axis = np.linspace(-1.0, 1.0, task.grid) * task.links.reach
    nodes = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    distance = np.hypot(*nodes.T)
    edge = 1e-9 * task.links.reach
    inside = (distance <= task.links.reach + edge) & (distance >= task.links.inner() - edge)
    return np.asarray(nodes[inside] + task.links.base)


def map_chunk(task: WorkspaceTask | SpatialTask, some: FloatArray) -> dict[str, FloatArray]:
    """The measures at some points; each point's depend on the task and on it alone.

    Args:
        task: What all points share.
        some: Points, (P, 2) of a planar arm, (P, 3) of one in space [m].

    Returns:
        By name, in percent (P, n + 1), the last column for any joint: R100, Ravg, Rsens, F100, Favg,
        Fsens, C100, Cavg, NaN where there is no configuration to say it; and counts (P,):
        ``configurations``, ``failed`` lines that ended at a singularity, ``runs`` after failures, and those
        of them that are ``unresolved``.
    """
    n, law = len(task.joints), task.study()
    rows = [_point(task, law, starts) for starts in task.starts(np.asarray(some, dtype=np.float64))]
    found: dict[str, FloatArray] = {}
    for name in MEASURES:
        found[name] = np.array([row[name] for row in rows]).reshape(len(rows), n + 1)
    for name in COUNTS:
        found[name] = np.array([row[name] for row in rows], dtype=np.float64)
    return found


COUNTS = ("configurations", "failed", "runs", "unresolved")
"""Names of the counts of a chunk."""


def _point(task: WorkspaceTask | SpatialTask, law: LawStudy, starts: FloatArray) -> dict[str, Any]:
    """Measures and counts of one point, of the configurations at it."""
    inside, failed, q, within = law.lines(
        starts, task.steps, task.box, circular=task.circular, keep=task.asks
    )
    F, runs, unresolved = np.ones_like(inside), 0, 0
    if task.asks:
        weight = np.ones(q.shape[:2])
        weight[:, (0, -1)] = 0.5
        good, nodes = ~failed, task.nodes
        ok, runs, unresolved = _after_failures(task, law, q[good][:, nodes], within[good][:, nodes])
        with np.errstate(invalid="ignore", divide="ignore"):
            share = weight[good][:, nodes, None] * within[good][:, nodes]
            F[good] = (share * ok).sum(axis=1) / share.sum(axis=1)
    measures = measures_of(inside[~failed], F[~failed])
    counts = {"configurations": len(starts), "failed": int(failed.sum())}
    return {**measures, **counts, "runs": runs, "unresolved": unresolved}


def _after_failures(
    task: WorkspaceTask | SpatialTask, law: LawStudy, q: FloatArray, within: BoolArray
) -> tuple[BoolArray, int, int]:
    """Whether a failure at each node ends well, (C, k, n + 1); how many ran, and came to no verdict."""
    n = len(task.joints)
    asked = within[:, :, :n].copy()
    asked[:, task.nodes == task.steps] = False  # at the goal nothing moves
    if task.suspects is not None:
        for i, intervals in enumerate(task.suspects):
            asked[:, :, i] &= _in_any(q[:, :, i], intervals)
    line, node, joint = np.nonzero(asked)
    endings, _, _ = law.runs(q[line, node], 1 << joint)
    ok = np.ones(within.shape, dtype=np.bool_)
    ok[line, node, joint] = endings == CORRECT
    ok[:, :, n] = ok[:, :, :n].all(axis=2)
    return ok, len(endings), int((endings == UNRESOLVED).sum())


def _in_any(angle: FloatArray, intervals: Intervals) -> BoolArray:
    """Whether angles lie in one of the intervals on the circle."""
    found = np.zeros(angle.shape, dtype=np.bool_)
    for low, high in intervals:
        found |= np.mod(angle - low, 2.0 * np.pi) <= high - low
    return found


def _suspects(task: WorkspaceTask) -> list[Intervals]:
    """For each joint the neighbourhoods of locked values with a trial that missed the goal."""
    study, n = task.study(), len(task.joints)
    width = 2.0 * np.pi / CELLS
    centre = np.linspace(-np.pi, np.pi, CELLS, endpoint=False) + 0.5 * width
    others = spread_evenly(PROBES, n, task.seed)
    found: list[Intervals] = []
    for i in range(n):
        ends = [
            end
            for low, high in task.box[i]
            if high - low > width
            for end in (low + INSET * width, high - INSET * width)
        ]
        values = np.concatenate([centre[_in_any(centre, task.box[i])], ends])
        starts = np.tile(others, (len(values), 1))
        starts[:, i] = np.repeat(values, PROBES)
        endings, _, _ = study.runs(starts, np.full(len(starts), 1 << i))
        bad = np.unique(np.repeat(values, PROBES)[endings != CORRECT])
        near = NEAR * width
        found.append(tuple((float(a - near), float(a + near)) for a in bad))
    return found
