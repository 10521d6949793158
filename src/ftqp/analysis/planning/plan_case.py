"""What a plan is made for: the task, its start and the knobs, in one record that every method takes."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import final

from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.planning.plan_settings import PlanSettings, Told
from ftqp.analysis.planning.portions import Here, Portions
from ftqp.analysis.survival.continuing import task_session
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.core.checks import FloatArray


def silent(done: int, total: int, what: str) -> None:
    """Tell nobody."""


@final
@dataclass(frozen=True, kw_only=True, eq=False)
class PlanCase:
    """What a method plans for."""

    task: TaskPath  # The path on its samples
    weights: FloatArray  # What a lock of each joint counts, (nv,), with the mean 1
    # Where the arm starts, exactly at the first sample, (nv,) [rad or m]; None leaves it free
    start: FloatArray | None = None
    settings: PlanSettings = field(default_factory=PlanSettings)  # The knobs
    seed: int = 0  # Of random starts
    told: Told = silent  # Hears of progress
    portions: Portions = field(default_factory=Here)  # Who computes the parts of the work

    @cached_property
    def study(self) -> GoalStudy:
        """Studies of the arm and the task rows, with steps of the settings' spacing."""
        return planning_study(self.task, self.settings.spacing)


def planning_study(task: TaskPath, spacing: float) -> GoalStudy:
    """Studies within the arm's limits of a task's rows; the goal is the first sample."""
    session = task_session(task)
    session.S.study.step = spacing
    return GoalStudy(robot=task.robot, rows=task.rows, pose=task.goals[0], free=session, limited=session)
