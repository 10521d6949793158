"""At which places of its workspace an arm can do without each of its joints."""

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from ftqp.analysis.goals import random_postures
from ftqp.analysis.survival.continuing import rows_session
from ftqp.control.inverse_kinematics.posture_search import task_rows
from ftqp.core.checks import FloatArray, IntArray, frozen, instance, positive, whole_number
from ftqp.kernel.entry.continuation_study import ContinuationStudy
from ftqp.kernel.layout.enums import Survival
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.model.robot import Robot

STEPS = 12
"""Samples of a line behind its first."""
DURATION = 6.0
"""Of a line [s]: long enough that speed does not matter."""
WAY = 0.5
"""Length of a line over the characteristic length: a twelfth of the reach."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class SurvivalMap:
    """What locks leave of a workspace; made by ``survival_map``.

    Attributes:
        robot: The arm.
        rows: Names of the task rows.
        places: Where the end effector is, (P, 3) [m].
        q: The postures there, (P, nv) [rad or m].
        lines: How many of the lines from each place the whole arm can follow, (P,).
        survived: How many of these it can follow with each joint locked where it is, (P, nv).
        way: The length of the lines [m].
    """

    robot: Robot
    rows: tuple[str, ...]
    places: FloatArray
    q: FloatArray
    lines: IntArray
    survived: IntArray
    way: float

    @property
    def per_joint(self) -> dict[str, float]:
        """The share of places from which all lines can be followed with the joint locked, by its name."""
        known = self.lines > 0
        kept = self.survived[known] == self.lines[known, None]
        return dict(zip(self.robot.joints, kept.mean(axis=0).tolist(), strict=True))

    @property
    def any_joint(self) -> float:
        """The share of places from which all lines can be followed whichever joint locks."""
        known = self.lines > 0
        return float((self.survived[known] == self.lines[known, None]).all(axis=1).mean())

    def __repr__(self) -> str:
        """What counts most."""
        return (
            f"SurvivalMap({self.robot.name!r}, rows={list(self.rows)}, places={len(self.places)}, "
            f"any_joint={self.any_joint:.3f})"
        )


def survival_map(
    robot: Robot, rows: Any = "pose", *, places: int = 100, way: float | None = None, seed: int = 0
) -> SurvivalMap:
    """At which share of its workspace an arm can go on when a joint locks.

    From random postures within the limits the end effector goes along straight lines, to and fro along each
    axis of the base whose row counts, its orientation kept where it counts. A lock is survived at a place if
    all lines that the whole arm can follow can be followed with the joint where it is.
    Source: docs/theory/coverage.md, "The map of a workspace".

    Args:
        robot: The arm.
        rows: ``"pose"`` or ``"position"``, which are those of the robot's own rows, ``"position_axis"`` for
            position and tool axis, or names of rows, of which one at least is x, y or z.
        places: How many postures, >= 1. More make the shares more certain.
        way: The length of a line, > 0 [m]; None is half the characteristic one. A longer one survives less.
        seed: Of the postures.

    Raises:
        InputError: The rows are unknown or more than joints, or a number is out of its range.
    """
    instance("robot", robot, Robot, "a Robot")
    whole_number("places", places, 1)
    length = WAY * robot.length if way is None else positive("way", way, "m")
    names, _ = task_rows(robot, rows)
    session = rows_session(robot, rows)
    q = random_postures(robot, places, seed)
    poses = np.stack([robot.pose(one) for one in q])
    directions = [side * np.eye(3)[k] for k in range(3) if COMPONENTS[k] in names for side in (1.0, -1.0)]
    bounded = robot.nv - 1 != len(names)
    lines, survived = np.zeros(places, np.int64), np.zeros((places, robot.nv), np.int64)
    for place, (start, pose) in enumerate(zip(q, poses, strict=True)):
        for direction in directions:
            runs = _line(robot, session, pose, length * direction)
            zero = np.zeros(1, np.int64)
            whole = runs.runs(start[None], zero, [-1], bounded=True, threads=1)
            if whole.status[0] != Survival.SURVIVED:
                continue
            lines[place] += 1
            each = np.arange(robot.nv)
            found = runs.runs(np.tile(start, (robot.nv, 1)), 0 * each, each, bounded=bounded, threads=1)
            survived[place] += found.status == Survival.SURVIVED
    return SurvivalMap(
        robot=robot,
        rows=names,
        places=frozen(poses[:, :3, 3].copy()),
        q=frozen(q),
        lines=frozen(lines),
        survived=frozen(survived),
        way=length,
    )


def _line(robot: Robot, session: Any, pose: FloatArray, way: FloatArray) -> ContinuationStudy:
    """Continuations along a straight line from a pose, to be followed to a hundredth of its length."""
    goals = np.tile(pose, (STEPS + 1, 1, 1))
    goals[:, :3, 3] += np.linspace(0.0, 1.0, STEPS + 1)[:, None] * way
    limits = robot.limits
    size = float(np.linalg.norm(way))
    return ContinuationStudy(
        session, goals, DURATION / STEPS, q_min=limits.q_min, q_max=limits.q_max, v_max=limits.v_max,
        a_max=limits.a_max, near=0.01 * size, turned=0.01 * size / robot.length,
    )  # fmt: skip
