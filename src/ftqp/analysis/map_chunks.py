"""A map of a workspace in pieces: what all its points share, and the measures of some of the points."""

from dataclasses import dataclass, replace
from typing import Any, Literal, final, get_args

import numpy as np

from ftqp.analysis.measures import MEASURES, measures_of
from ftqp.analysis.outcomes.weights import weights_inverse
from ftqp.analysis.planar_links import PlanarLinks, spread_evenly
from ftqp.analysis.spatial_map import (
    MOST_PARTS,
    MOST_POINTS,
    SpatialTask,
    spatial_chunk,
    spatial_points,
    whole_number,
)
from ftqp.core.checks import BoolArray, FloatArray, array, frozen, instance, positive
from ftqp.core.errors import InputError
from ftqp.kernel.entry.planar_study import Intervals, PlanarStudy
from ftqp.kernel.layout.endings import CORRECT, UNRESOLVED
from ftqp.model.robot import Robot

Length = Literal["cartesian", "joint"]
Box = Literal["product", "per_component"]

CELLS = 720
"""Locked values of a joint that are looked at for ends other than the goal."""
INSET = 0.05
"""Share of a cell from the ends of a range to the values that are looked at there."""
NEAR = 5.0
"""Cells to either side of a value with a miss that are suspects, too: basins shrink before they vanish."""
PROBES = 64
"""Configurations of the other joints that each of them is tried with."""
SUCCESS = 1e-2
"""The |e| that counts as correct within a horizon [mean link lengths]."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WorkspaceTask:
    """Everything of a map that does not depend on the point; made by ``workspace_task``, can be pickled.

    Attributes:
        joints: Names of the joints.
        links: The arm.
        M: The inverse of the weights, (n, n).
        goal: Where the tip is to go, (2,) [m].
        grid: Nodes of the grid along each axis.
        configurations: Configurations of each part of a point's self-motion.
        steps: Equal parts of a line to the goal.
        screen: Whether failures at values from which every trial went to the goal are taken as correct.
        horizon: Within which |e| must fall below 0.01 mean link lengths [s]; None asks where runs end.
        gain: K_e [1/s].
        v_max: The largest commanded speed of the tip [m/s].
        length: Whether shares are of the tip's way or of the joints'.
        boxes: For each box, for each joint, the values with which the goal stays within reach [rad].
        suspects: For each joint, locked values from which not every trial went to the goal [rad].
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
    horizon: float | None
    gain: float
    v_max: float
    length: Length
    boxes: list[list[Intervals]]
    suspects: list[Intervals]
    seed: int

    def study(self) -> PlanarStudy:
        """Compiled studies of the arm with this goal."""
        return self.links.study(self.M, self.links.local(self.goal))


def workspace_task(
    robot: Robot,
    goal: Any,
    *,
    grid: int = 52,
    configurations: int = 90,
    steps: int = 100,
    screen: bool = True,
    horizon: float | None = None,
    length: Length = "cartesian",
    box: Box = "product",
    W: Any = None,
    gain: float = 1.0,
    v_max: float | None = None,
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
    _one_of("length", length, get_args(Length))
    _one_of("box", box, get_args(Box))
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
    local = links.local(point)
    boxes = [links.ranges(local)] if box == "product" else links.boxes(local)
    limit = np.inf if v_max is None else positive("v_max", v_max, "m/s")
    task = WorkspaceTask(
        joints=robot.joints, links=links, M=frozen(M), goal=frozen(point), grid=int(grid),
        configurations=int(configurations), steps=int(steps), screen=bool(screen),
        horizon=None if horizon is None else positive("horizon", horizon, "s"),
        gain=positive("gain", gain, "1/s"), v_max=limit, length=length, boxes=boxes,
        suspects=[() for _ in robot.joints], seed=seed,
    )  # fmt: skip
    if not screen or horizon is not None:
        return task
    return replace(task, suspects=_suspects(task))


def _one_of(name: str, got: Any, valid: tuple[str, ...]) -> None:
    """Refuses a word that is none of the valid ones."""
    if got not in valid:
        raise InputError(f"{name} is {got!r}, expected {' or '.join(repr(word) for word in valid)}")


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
    n = len(task.joints)
    if isinstance(task, SpatialTask):
        rows = spatial_chunk(task, np.asarray(some, dtype=np.float64).reshape(-1, 3))
    else:
        study = task.study()
        rows = [_point(task, study, point) for point in np.asarray(some, dtype=np.float64).reshape(-1, 2)]
    found: dict[str, FloatArray] = {}
    for name in MEASURES:
        found[name] = np.array([row[name] for row in rows]).reshape(len(rows), n + 1)
    for name in COUNTS:
        found[name] = np.array([row[name] for row in rows], dtype=np.float64)
    return found


COUNTS = ("configurations", "failed", "runs", "unresolved")
"""Names of the counts of a chunk."""


def _point(task: WorkspaceTask, study: PlanarStudy, point: FloatArray) -> dict[str, Any]:
    """Measures and counts of one point."""
    parts = task.links.configurations(task.links.local(point), task.configurations, task.seed)
    starts = np.concatenate([np.empty((0, len(task.joints))), *parts])
    asks = not task.screen or task.horizon is not None or any(task.suspects)
    by_joints = task.length == "joint"
    inside, failed, q, within = study.lines(starts, task.steps, task.boxes, by_joints=by_joints, keep=asks)
    F = np.ones_like(inside)
    runs = unresolved = 0
    if asks:
        ok, runs, unresolved = _after_failures(task, study, q, within)
        weight = np.ones(q.shape[:2])
        if by_joints:
            way = np.linalg.norm(np.diff(q, axis=1), axis=2)
            weight[:, 0], weight[:, 1:] = 0.0, way
            weight[:, :-1] += way
        else:
            weight[:, (0, -1)] = 0.5
        with np.errstate(invalid="ignore", divide="ignore"):
            share = weight[:, :, None] * within
            F = np.asarray((share * ok).sum(axis=1) / share.sum(axis=1))
    good = ~failed
    measures = measures_of(inside[good], F[good])
    counts = {"configurations": len(starts), "failed": int(failed.sum())}
    return {**measures, **counts, "runs": runs, "unresolved": unresolved}


def _after_failures(
    task: WorkspaceTask, study: PlanarStudy, q: FloatArray, within: BoolArray
) -> tuple[BoolArray, int, int]:
    """Whether a failure at each node ends well, (C, K + 1, n + 1); how many ran, and came to no verdict."""
    n = len(task.joints)
    asked = within[:, :, :n].copy()
    asked[:, -1] = False  # at the goal nothing moves
    if task.screen and task.horizon is None:
        for i, intervals in enumerate(task.suspects):
            asked[:, :, i] &= _in_any(q[:, :, i], intervals)
    line, node, joint = np.nonzero(asked)
    if task.horizon is None:
        endings, _, _ = study.runs(q[line, node], 1 << joint)
    else:
        endings, _, _ = study.runs(
            q[line, node], 1 << joint, horizon=task.horizon, success=SUCCESS, gain=task.gain,
            v_max=task.v_max / task.links.scale,
        )  # fmt: skip
    ok = np.ones(within.shape, dtype=np.bool_)
    ok[line, node, joint] = endings == CORRECT
    ok[:, :, n] = ok[:, :, :n].all(axis=2)
    unresolved = 0 if task.horizon is not None else int((endings == UNRESOLVED).sum())
    return ok, len(endings), unresolved


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
            for box in task.boxes
            for low, high in box[i]
            if high - low > width
            for end in (low + INSET * width, high - INSET * width)
        ]
        inside = [_in_any(centre, box[i]) for box in task.boxes]
        values = np.concatenate([centre[np.any(inside, axis=0)], ends])
        starts = np.tile(others, (len(values), 1))
        starts[:, i] = np.repeat(values, PROBES)
        endings, _, _ = study.runs(starts, np.full(len(starts), 1 << i))
        bad = np.unique(np.repeat(values, PROBES)[endings != CORRECT])
        near = NEAR * width
        found.append(tuple((float(a - near), float(a + near)) for a in bad))
    return found
