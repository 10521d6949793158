"""A goal of an arm: task rows, the pose to reach, and compiled studies of both."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
from scipy.stats import qmc

from ftqp.control.task.task import row_indices
from ftqp.core.checks import BoolArray, FloatArray, array
from ftqp.core.errors import InputError
from ftqp.core.pose import pose as checked_pose
from ftqp.core.pose import transform
from ftqp.kernel.entry.study_session import StudySession
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.model.robot import Robot

STEP = 0.05
"""Largest step of a traced curve [rad or m]."""

DEPENDENT = 1e-9
"""Share of the largest singular value below which task rows do not move independently."""

SPAN_BY_LENGTH = 6.0
"""Sliding joints without limits start within so many characteristic lengths of zero: the reach."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GoalStudy:
    """A robot, its task rows and a goal; made by ``goal_study``.

    Attributes:
        robot: The arm.
        rows: Names of the task rows.
        pose: The goal, (4, 4); rows that do not count are arbitrary.
        free: Studies in which joints that turn have no limits, their values counting modulo one turn.
        limited: Studies with the robot's limits.
        idle: Indices of joints that never move the task rows, as one whose axis goes through the tip.
    """

    robot: Robot
    rows: tuple[str, ...]
    pose: FloatArray
    free: StudySession
    limited: StudySession
    idle: tuple[int, ...] = ()

    @property
    def m(self) -> int:
        """Number of task rows."""
        return len(self.rows)

    @property
    def redundancy(self) -> int:
        """r = nv - m, the dimension of self-motions."""
        return self.robot.nv - self.m

    @property
    def tolerance(self) -> float:
        """The error of a solution that counts as none [m]."""
        return float(self.free.S.study.tolerance)

    @property
    def turning(self) -> BoolArray:
        """Joints that turn without position limits, (nv,): their values lie on a circle."""
        limits = self.robot.limits
        ends = np.isinf(limits.q_min) & np.isinf(limits.q_max)
        return np.asarray(~self.robot.chain.prismatic & ends)

    @property
    def has_limits(self) -> bool:
        """Whether a joint that turns has a position limit."""
        return bool((~self.robot.chain.prismatic & ~self.turning).any())

    def starts(self, count: int, *, limited: bool = False) -> FloatArray:
        """Joint values that fill all turns, or the limits, evenly and the same every time, (count, nv)."""
        low, high = start_box(self.robot, limited)
        share = qmc.Sobol(self.robot.nv, seed=0).random(count)
        return np.asarray(low + share * (high - low))

    def unreachable(self, error: float) -> InputError:
        """The error of a goal that no configuration reaches.

        Args:
            error: The smallest error that was found [m].
        """
        place = ", ".join(f"{x:.6g}" for x in self.pose[:3, 3])
        return InputError(
            f"the goal at ({place}) is not reached by {self.robot.name} (nearest: {error:.3g} m off in rows "
            f"{', '.join(self.rows)}); expected a goal inside the workspace"
        )


def goal_study(robot: Robot, goal: Any, rows: Any, step: float = STEP) -> GoalStudy:
    """The study of a goal.

    Args:
        robot: The arm.
        goal: A point, (2,) for rows among x and y or (3,) without rotation [m], or a pose, (4, 4).
        rows: ``"pose"`` or ``"position"``, which are those of the robot's own rows, or names of rows.
        step: Largest step of a traced curve [rad or m].
    """
    names = row_names(robot, rows)
    pose = _goal_pose(goal, names)
    indices = [COMPONENTS.index(name) for name in names]
    free = robot_session(robot, indices, limited=False, step=step)
    limited = robot_session(robot, indices, step=step)
    free.aim(pose)
    limited.aim(pose)
    study = GoalStudy(robot=robot, rows=names, pose=pose, free=free, limited=limited)
    _, A, _, _ = free.values(study.starts(8))
    sigma = np.linalg.svd(A, compute_uv=False)
    if len(names) <= robot.nv and (sigma[:, -1] < DEPENDENT * sigma[:, 0]).all():
        raise InputError(
            f"rows {', '.join(names)} of {robot.name} do not move independently anywhere; "
            f"leave some out, for example take {', '.join(robot.default_rows)}"
        )
    moved = np.abs(A).max(axis=(0, 1))
    return replace(study, idle=tuple(int(i) for i in np.flatnonzero(moved < DEPENDENT * moved.max())))


def robot_session(
    robot: Robot, indices: Sequence[int], *, limited: bool = True, step: float = STEP, axis: bool = False
) -> StudySession:
    """Studies of an arm with some task rows.

    Args:
        robot: The arm.
        indices: Which of x, y, z, rx, ry, rz count, (m,).
        limited: Whether joints that turn have their limits; without, their values count modulo one turn.
        step: Largest step of a traced curve [rad or m].
        axis: Whether rx and ry are the shortest turn of the tool's z axis.

    Raises:
        InputError: The robot has branches.
    """
    robot.refuse_tree("a study of an arm's postures needs")
    limits, slides = robot.limits, robot.chain.prismatic
    kept = slides | limited
    low, high = np.where(kept, limits.q_min, -np.inf), np.where(kept, limits.q_max, np.inf)
    return StudySession(
        robot.chain.constants(), indices, robot.length, q_min=low, q_max=high,
        wraps=~slides & np.isinf(low) & np.isinf(high), step=step, axis=axis,
    )  # fmt: skip


def row_names(robot: Robot, rows: Any) -> tuple[str, ...]:
    """Names of task rows."""
    if isinstance(rows, str) and rows == "position_axis":
        raise InputError("rows is 'position_axis', expected 'pose', 'position' or names of rows")
    names = tuple(COMPONENTS[i] for i in row_indices(rows))
    if isinstance(rows, str) and rows not in COMPONENTS:
        names = tuple(name for name in names if name in robot.default_rows)
    if not names:
        raise InputError(
            f"rows {rows!r} leave none of {robot.name}, whose own rows are {', '.join(robot.default_rows)}; "
            "give names of rows"
        )
    return names


def _goal_pose(goal: Any, rows: tuple[str, ...]) -> FloatArray:
    """The goal as a pose, (4, 4)."""
    shape = np.shape(getattr(goal, "homogeneous", goal))
    if shape == (4, 4):
        return checked_pose(goal, "goal")
    turning = [name for name in rows if name.startswith("r")]
    if shape in ((2,), (3,)):
        if turning:
            raise InputError(
                f"goal has shape {shape} and the task the rows {', '.join(turning)}; give a pose (4, 4)"
            )
        if shape == (2,) and "z" in rows:
            raise InputError("goal has shape (2,) and the task a row z; give a point (3,)")
        point = np.zeros(3)
        point[: shape[0]] = array("goal", goal, shape)
        return transform(np.eye(3), point)
    raise InputError(f"goal has shape {shape}, expected a point (2,) or (3,), or a pose (4, 4)")


def random_postures(robot: Robot, count: int, seed: int = 0) -> FloatArray:
    """Random postures within the limits, the same every time, (count, nv) [rad or m]."""
    low, high = start_box(robot, limited=True)
    return np.asarray(low + np.random.default_rng(seed).random((count, robot.nv)) * (high - low))


def start_box(robot: Robot, limited: bool) -> tuple[FloatArray, FloatArray]:
    """Between which values joints are looked at, (nv,) each [rad or m]."""
    reach = SPAN_BY_LENGTH * robot.length
    span = np.where(robot.chain.prismatic, reach, np.pi)
    low, high = robot.limits.q_min, robot.limits.q_max
    kept = robot.chain.prismatic | limited
    below = np.where(kept & np.isfinite(low), low, np.where(kept & np.isfinite(high), high - 2 * span, -span))
    above = np.where(kept & np.isfinite(high), high, below + 2 * span)
    return below, above
