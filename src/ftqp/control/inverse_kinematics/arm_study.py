"""The study of an arm and some rows of its tip's pose: what inverse kinematics is made with."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ftqp.control.task.task import ROW_SETS, row_indices
from ftqp.core.checks import FloatArray, array
from ftqp.core.errors import InputError
from ftqp.core.pose import pose as checked_pose
from ftqp.core.pose import transform
from ftqp.kernel.entry.study_session import StudySession
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.model.robot import Robot

STEP = 0.05
"""Largest step of a traced curve [rad or m]."""

SPAN_BY_LENGTH = 6.0
"""Sliding joints without limits start within so many characteristic lengths of zero: the reach, exactly."""


def robot_session(
    robot: Robot, indices: Sequence[int], *, limited: bool = True, step: float = STEP, axis: bool = False
) -> StudySession:
    """Studies of an arm with some task rows."""
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


def task_rows(robot: Robot, rows: Any) -> tuple[tuple[str, ...], bool]:
    """Names of task rows, and whether they are those of a position and a tool axis."""
    axis = isinstance(rows, str) and rows == "position_axis"
    names = ROW_SETS["position_axis"] if axis else row_names(robot, rows)
    if axis and not set(COMPONENTS) <= set(robot.default_rows):
        raise InputError(
            f"rows is 'position_axis' and {robot.name} has the rows {', '.join(robot.default_rows)}; "
            "expected an arm that moves in space"
        )
    if robot.nv < len(names):
        raise InputError(
            f"{robot.name} has {robot.nv} joints and the task {len(names)} rows; expected at least as many "
            "joints as rows"
        )
    return names, axis


def goal_pose(goal: Any, rows: tuple[str, ...]) -> FloatArray:
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


def start_box(robot: Robot, limited: bool) -> tuple[FloatArray, FloatArray]:
    """Between which values joints are looked at, (nv,) each [rad or m]."""
    reach = SPAN_BY_LENGTH * robot.length
    span = np.where(robot.chain.prismatic, reach, np.pi)
    low, high = robot.limits.q_min, robot.limits.q_max
    kept = robot.chain.prismatic | limited
    below = np.where(kept & np.isfinite(low), low, np.where(kept & np.isfinite(high), high - 2 * span, -span))
    above = np.where(kept & np.isfinite(high), high, below + 2 * span)
    return below, above
