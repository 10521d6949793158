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
    """What a method plans for.

    Attributes:
        task: The path on its samples.
        weights: What a lock of each joint counts, (nv,), with the mean 1.
        start: Where the arm starts, exactly at the first sample, (nv,) [rad or m]; None leaves it free.
        settings: The knobs.
        seed: Of random starts.
        told: Hears of progress.
        portions: Who computes the parts of the work.
    """

    task: TaskPath
    weights: FloatArray
    start: FloatArray | None = None
    settings: PlanSettings = field(default_factory=PlanSettings)
    seed: int = 0
    told: Told = silent
    portions: Portions = field(default_factory=Here)

    @cached_property
    def study(self) -> GoalStudy:
        """Studies of the arm and the task rows, with steps of the settings' spacing."""
        return planning_study(self.task, self.settings.spacing)


def planning_study(task: TaskPath, spacing: float) -> GoalStudy:
    """Studies within the arm's limits of a task's rows; the goal is the first sample.

    Args:
        task: The task.
        spacing: Largest step along a self-motion [rad or m].
    """
    session = task_session(task)
    session.S.study.step = spacing
    return GoalStudy(robot=task.robot, rows=task.rows, pose=task.goals[0], free=session, limited=session)
