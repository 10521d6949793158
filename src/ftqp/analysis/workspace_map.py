"""Where a task may begin: measures of a whole workspace for failures that nobody reports."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from os import PathLike
from typing import Any, Self, final

import numpy as np

from ftqp.analysis.map_chunks import (
    COUNTS,
    MEASURES,
    Plane,
    WorkspaceTask,
    map_chunk,
    points,
    workspace_task,
)
from ftqp.core.checks import FloatArray, IntArray, frozen, whole_number
from ftqp.core.errors import InputError
from ftqp.kernel.entry.session import thread_count
from ftqp.model.robot import Robot

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

    def interval(self, name: str) -> FloatArray:
        """The 95 % interval of a share over all configurations of all points, (nv + 1, 2) [percent].

        It is Wilson's, as if configurations were drawn independently; those of one point are not quite.

        Args:
            name: ``R100``, ``F100`` or ``C100``.

        Raises:
            InputError: It is none of these.
        """
        if name not in ("R100", "F100", "C100"):
            raise InputError(f"{name!r} is not a share of configurations; it is R100, F100 or C100")
        value = getattr(self, name)
        count = np.where(np.isnan(value), 0, (self.configurations - self.failed)[:, None])
        total = np.maximum(count.sum(axis=0), 1)
        share = np.where(count > 0, value, 0.0) / 100.0
        p, z = (share * count).sum(axis=0) / total, 1.959964
        middle = (p + z * z / (2.0 * total)) / (1.0 + z * z / total)
        half = z / (1.0 + z * z / total) * np.sqrt(p * (1.0 - p) / total + (z / (2.0 * total)) ** 2)
        return np.asarray(100.0 * np.stack([middle - half, middle + half], axis=1))

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

    def save(self, path: str | PathLike[str]) -> None:
        """Write everything to a compressed file of numpy's, one array for each attribute.

        Args:
            path: The file; ``.npz`` is added where it is missing.
        """
        arrays = {name: getattr(self, name) for name in ("points", "goal", *MEASURES, *COUNTS)}
        np.savez_compressed(path, joints=np.array(self.joints), **arrays)


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
        W: Weights of the joint rates, (nv, nv) or its diagonal (nv,), positive definite; None is the
            identity.
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
