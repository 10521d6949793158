"""Where a task may begin: measures of a whole workspace for failures that nobody reports."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Final, Literal, Self, final, get_args

import numpy as np

from ftqp.analysis.circular_intervals import TURN, CircularIntervals
from ftqp.analysis.goals import goal_study
from ftqp.analysis.manifolds.joint_ranges import ranges_of
from ftqp.analysis.manifolds.manifold import manifold_of, traced_curves
from ftqp.analysis.outcomes.unaware_law import weights_inverse
from ftqp.core.checks import BoolArray, FloatArray, IntArray, frozen, instance, whole_number
from ftqp.core.errors import InputError
from ftqp.kernel.entry.law_study import LawStudy
from ftqp.kernel.entry.session import thread_count
from ftqp.kernel.layout.enums import CORRECT, UNRESOLVED
from ftqp.model.robot import Robot

Plane = Literal["xy", "xz", "yz"]

MOST_POINTS, MOST_PARTS = 4_000_000, 100_000
"""Nodes that a grid has at most, and configurations at a point and parts of a line."""
SOLVED = 1e-9
"""A configuration so near a pose is at it [unit lengths]."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WorkspaceTask:
    """Everything of a map that does not depend on the point; made by ``workspace_task``, can be pickled.

    Attributes:
        joints: Names of the joints.
        robot: The arm.
        rows: Names of the task rows.
        pose: The goal, (4, 4); the end effector has its orientation on all of a line, where rotation counts.
        goal: Its position, (3,) [m].
        M: The inverse of the weights, (n, n).
        grid: Nodes of the grid along each axis.
        plane: Two of x, y and z that span a plane through the goal; None fills all of the space.
        configurations: At each point, of each self-motion that is traced, or from so many starts.
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

    @property
    def nodes(self) -> IntArray:
        """The nodes of a line at which joints fail."""
        return ((np.arange(self.instants) + 0.5) * self.steps / self.instants).astype(np.int64)

    def study(self) -> LawStudy:
        """Compiled studies of the arm with this goal."""
        return LawStudy(goal_study(self.robot, self.pose, list(self.rows)).free, self.M, self.unit)

    def starts(self, some: FloatArray) -> Iterator[FloatArray]:
        """The configurations at each of some points, (C, n) [rad or m].

        They are at equal arc lengths of each self-motion of joints that turn without limits, where one is to
        spare; else what is found from quasi-random starts within the limits.
        """
        study, n = goal_study(self.robot, self.pose, list(self.rows)), len(self.joints)
        traced = study.redundancy == 1 and not study.has_limits
        starts = self._spread()
        for point in some.reshape(-1, 3):
            begin = self.pose.copy()
            begin[:3, 3] = point
            if traced:
                study.free.aim(begin)
                try:
                    curves = traced_curves(study)
                except InputError:  # the point is at the edge of the workspace
                    curves = []
                parts = [manifold_of(study, curve).spread(self.configurations) for curve in curves]
                yield np.concatenate([np.empty((0, n)), *parts])
            else:
                solved, left, _ = study.limited.solutions(starts, goals=begin[None], bounded=True)
                yield solved[left < SOLVED * self.unit]

    def _spread(self) -> FloatArray:
        """Starts within the limits, of all turns where there are none, (configurations, n) [rad or m]."""
        limits = self.robot.limits
        starts = spread_evenly(self.configurations, len(self.joints), self.seed)
        ends = np.isfinite(limits.q_min) & np.isfinite(limits.q_max)
        share = (starts[:, ends] + np.pi) / TURN
        starts[:, ends] = limits.q_min[ends] + share * (limits.q_max - limits.q_min)[ends]
        return starts


def spread_evenly(count: int, dimension: int, seed: int) -> FloatArray:
    """Angles spread evenly over all turns, (count, dimension) [rad], the same every time.

    Source: the additive recurrence of Roberts 2018 with the generalised golden ratio; no formula needs it.
    """
    ratio = 2.0
    for _ in range(60):
        ratio = (1.0 + ratio) ** (1.0 / (dimension + 1.0))
    steps = ratio ** -np.arange(1.0, dimension + 1.0)
    offset = np.random.default_rng(seed).random(dimension)
    return np.asarray(TURN * ((offset + np.outer(np.arange(count), steps)) % 1.0) - np.pi)


def workspace_task(
    robot: Robot,
    goal: Any,
    rows: Any = "position",
    *,
    grid: int = 52,
    configurations: int = 90,
    steps: int = 100,
    plane: Plane | None = "xz",
    instants: int = 4,
    W: Any = None,
    seed: int = 0,
) -> WorkspaceTask:
    """What all points of a map share; see ``workspace`` for the arguments.

    Raises:
        InputError: The goal does not fit the rows or is out of reach, W is not positive definite, or a number
            is out of its range.
    """
    instance("robot", robot, Robot, "a Robot")
    if plane is not None and plane not in get_args(Plane):
        raise InputError(f"plane is {plane!r}, expected 'xy', 'xz' or 'yz', or None for all of the space")
    finest = MOST_POINTS ** (1.0 / 3.0) if plane is None else MOST_POINTS**0.5
    whole_number("grid", grid, 2, int(finest))
    for name, value, least in (
        ("configurations", configurations, 1),
        ("steps", steps, 1),
        ("instants", instants, 0),
    ):
        whole_number(name, value, least, MOST_PARTS)
    M = weights_inverse(W, robot.nv)
    study = goal_study(robot, goal, rows)
    found = ranges_of(study)
    moved = "".join(axis for axis in "xyz" if axis in study.rows)
    return WorkspaceTask(
        joints=robot.joints, robot=robot, rows=study.rows, pose=frozen(study.pose.copy()),
        goal=frozen(study.pose[:3, 3].copy()), M=frozen(M), grid=int(grid),
        plane=moved if moved in get_args(Plane) else plane, configurations=int(configurations),
        steps=int(steps), instants=min(int(instants), int(steps)),
        ranges=tuple(found[joint] for joint in robot.joints), seed=seed,
    )  # fmt: skip


def points(task: WorkspaceTask) -> FloatArray:
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
    there; like F it is open where no failure was simulated at a node in range.
    Source: goel2005, section 4, and docs/theory/after-a-failure.md, "Lines and measures".
    """
    shares = {"R": R, "F": F, "C": np.where(R > 0.0, R * F, 0.0)}
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


def map_chunk(task: WorkspaceTask, some: FloatArray) -> dict[str, FloatArray]:
    """The measures at some points; each point's depend on the task and on it alone.

    Args:
        task: What all points share.
        some: Points, (P, 3) [m].

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


def _point(task: WorkspaceTask, law: LawStudy, starts: FloatArray) -> dict[str, Any]:
    """Measures and counts of one point, of the configurations at it."""
    box, circular = [one.intervals for one in task.ranges], [one.circular for one in task.ranges]
    inside, failed, q, within = law.lines(starts, task.steps, box, circular=circular, keep=True)
    weight = np.ones(q.shape[:2])
    weight[:, (0, -1)] = 0.5
    good, nodes = ~failed, task.nodes
    ok, runs, unresolved = _after_failures(law, q[good][:, nodes], within[good][:, nodes])
    with np.errstate(invalid="ignore", divide="ignore"):
        share = weight[good][:, nodes, None] * within[good][:, nodes]
        F = (share * ok).sum(axis=1) / share.sum(axis=1)
    measures = measures_of(inside[good], F)
    counts = {"configurations": len(starts), "failed": int(failed.sum())}
    return {**measures, **counts, "runs": runs, "unresolved": unresolved}


def _after_failures(law: LawStudy, q: FloatArray, within: BoolArray) -> tuple[BoolArray, int, int]:
    """Whether a failure at each node ends well, (C, k, n + 1); how many ran, and came to no verdict."""
    n = q.shape[2]
    line, node, joint = np.nonzero(within[:, :, :n])
    endings, _, _ = law.runs(q[line, node], 1 << joint)
    ok = np.ones(within.shape, dtype=np.bool_)
    ok[line, node, joint] = endings == CORRECT
    ok[:, :, n] = ok[:, :, :n].all(axis=2)
    return ok, len(endings), int((endings == UNRESOLVED).sum())


CHUNK = 16
"""Points of a chunk: a few hundredths of a second of work."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WorkspaceReport:
    """The measures of a workspace in percent, (points, nv + 1); the last column is for any joint.

    R is the share of the straight line to the goal on which the goal stays within reach when a joint locks, F
    the share of that part from which the law brings the end effector to the goal though it does not know, and
    C the share of the whole line with both. 100: share of the configurations with all of it; avg: mean over
    the configurations; sens: largest minus smallest.

    Attributes:
        joints: Names of the joints.
        points: Where tasks begin, (P, 3) [m].
        goal: Where they end, (3,) [m].
        R100: Configurations with R = 1.
        Ravg: Mean of R.
        Rsens: Spread of R.
        F100: Configurations with F = 1.
        Favg: Mean of F.
        Fsens: Spread of F.
        C100: Configurations with C = 1.
        Cavg: Mean of C.
        configurations: How many there are at each point, (P,).
        failed: Lines that ended at a singularity of the healthy arm; no measure counts them, (P,).
        runs: Failures whose outcome was simulated, (P,).
        unresolved: Those of them that came to no verdict, counted as not correct, (P,).
    """

    joints: tuple[str, ...]
    points: FloatArray
    goal: FloatArray
    R100: FloatArray
    Ravg: FloatArray
    Rsens: FloatArray
    F100: FloatArray
    Favg: FloatArray
    Fsens: FloatArray
    C100: FloatArray
    Cavg: FloatArray
    configurations: IntArray
    failed: IntArray
    runs: IntArray
    unresolved: IntArray

    @classmethod
    def of(cls, task: WorkspaceTask, some: FloatArray, found: dict[str, FloatArray]) -> Self:
        """The report of a task.

        Args:
            task: What was asked.
            some: The points, (P, 3) [m].
            found: Their measures and counts as of ``map_chunk``.
        """
        counts = {name: frozen(np.asarray(found[name]).astype(np.int64)) for name in COUNTS}
        measures = {name: frozen(np.asarray(found[name], dtype=np.float64)) for name in MEASURES}
        return cls(joints=task.joints, points=frozen(some), goal=task.goal, **measures, **counts)

    def means(self) -> dict[str, FloatArray]:
        """The mean of each measure over the points that have it, (nv + 1,) [percent]."""
        found = {}
        for name in MEASURES:
            value = getattr(self, name)
            said = ~np.isnan(value)
            total = np.where(said, value, 0.0).sum(axis=0)
            found[name] = np.where(said.any(axis=0), total / np.maximum(said.sum(axis=0), 1), np.nan)
        return found

    def table(self) -> str:
        """The means over the points as a text table, and what was counted."""
        heads = [*self.joints, "any"]
        width = max(7, *(len(head) for head in heads))
        lines = ["mean [%]" + "".join(f"  {head:>{width}}" for head in heads)]
        for name, mean in self.means().items():
            lines.append(f"{name:<8}" + "".join(f"  {value:>{width}.2f}" for value in mean))
        lines.append(
            f"{len(self.points)} points, {self.configurations.sum()} configurations, "
            f"{self.failed.sum()} lines failed, {self.runs.sum()} runs, {self.unresolved.sum()} unresolved"
        )
        return "\n".join(lines)


def workspace(
    robot: Robot,
    goal: Any,
    *,
    grid: int = 52,
    configurations: int = 90,
    steps: int = 100,
    W: Any = None,
    jobs: int | None = None,
    seed: int = 0,
    rows: Any = "position",
    plane: Plane | None = "xz",
    instants: int = 4,
) -> WorkspaceReport:
    """From which points a straight line to a goal survives a lock that nobody notices.

    Every configuration at a point leads the tip straight to the goal; at every part of its line each joint is
    taken to lock. Reach counts the limits of the joints; the law does not know them.
    Source: goel2005, section 4, and docs/theory/after-a-failure.md.

    Args:
        robot: The arm.
        goal: Where the tip is to go, (2,) or (3,) [m], or a pose (4, 4).
        grid: Nodes along each axis of a square as wide as the reach, >= 2; more is a finer map.
        configurations: At a point, >= 1: of each of its self-motions, at equal arc lengths, where joints turn
            without limits and one is to spare, else from so many quasi-random starts. More is smoother.
        steps: Equal parts of a line, >= 1; more finds shorter stretches out of reach.
        W: Weights of the joint rates, positive definite, (nv, nv) or diagonal (nv,); None is the identity.
        jobs: Threads; None takes one for each core. The result does not depend on it.
        seed: Moves the quasi-random starts.
        rows: ``"position"``, ``"pose"`` or names of task rows. Where rotation counts the tip has the goal's
            on all of a line.
        plane: The plane through the goal that is mapped, of rows with x, y and z; None maps all of the space.
        instants: At how many nodes of a line failures are simulated, >= 0; at none, only R is said.

    Raises:
        InputError: The goal is out of reach, W is not positive definite, or a number is not positive.
    """
    threads = thread_count() if jobs is None else jobs
    whole_number("jobs", threads, 1)
    task = workspace_task(
        robot, goal, rows, grid=grid, configurations=configurations, steps=steps, plane=plane,
        instants=instants, W=W, seed=seed,
    )  # fmt: skip
    every = points(task)
    chunks = [every[k : k + CHUNK] for k in range(0, len(every), CHUNK)]
    with ThreadPoolExecutor(int(threads)) as pool:
        parts = list(pool.map(lambda chunk: map_chunk(task, chunk), chunks))
    found = {name: np.concatenate([part[name] for part in parts]) for name in (*MEASURES, *COUNTS)}
    return WorkspaceReport.of(task, every, found)
