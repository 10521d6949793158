"""A goal of an arm: task rows, the pose to reach, and compiled studies of both."""

from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
from scipy.stats import qmc

from ftqp.control.inverse_kinematics.posture_search import STEP as STEP
from ftqp.control.inverse_kinematics.posture_search import goal_pose, robot_session, row_names, start_box
from ftqp.core.checks import BoolArray, FloatArray
from ftqp.core.errors import InputError
from ftqp.kernel.entry.study_session import StudySession
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.model.robot import Robot

DEPENDENT = 1e-9
"""Share of the largest singular value below which task rows do not move independently."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GoalStudy:
    """A robot, its task rows and a goal; made by ``goal_study``."""

    robot: Robot  # The arm
    rows: tuple[str, ...]  # Names of the task rows
    pose: FloatArray  # The goal, (4, 4); rows that do not count are arbitrary
    # Studies in which joints that turn have no limits, their values counting modulo one turn
    free: StudySession
    limited: StudySession  # Studies with the robot's limits
    # Indices of joints that never move the task rows, as one whose axis goes through the tip
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
        """The error of a goal that no configuration reaches."""
        place = ", ".join(f"{x:.6g}" for x in self.pose[:3, 3])
        return InputError(
            f"the goal at ({place}) is not reached by {self.robot.name} (nearest: {error:.3g} m off in rows "
            f"{', '.join(self.rows)}); expected a goal inside the workspace"
        )


def goal_study(robot: Robot, goal: Any, rows: Any, step: float = STEP) -> GoalStudy:
    """The study of a goal."""
    names = row_names(robot, rows)
    pose = goal_pose(goal, names)
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


def random_postures(robot: Robot, count: int, seed: int = 0) -> FloatArray:
    """Random postures within the limits, the same every time, (count, nv) [rad or m]."""
    low, high = start_box(robot, limited=True)
    return np.asarray(low + np.random.default_rng(seed).random((count, robot.nv)) * (high - low))
