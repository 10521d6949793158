"""Compiled studies of a task for planning: nodes on its self-motions, and Newton steps onto its path."""

from ftqp.analysis.goals import STUDY_ENTRIES, GoalStudy
from ftqp.analysis.survival.continuing import ENTRIES, task_session
from ftqp.analysis.survival.task_path import TaskPath
from ftqp.control.first_use import warm_up
from ftqp.kernel.layout.record import capacity_for


def planning_study(task: TaskPath, spacing: float) -> GoalStudy:
    """Studies within the arm's limits of a task's rows; the goal is the first sample.

    Args:
        task: The task.
        spacing: Largest step along a self-motion [rad or m].
    """
    warm_up(dict.fromkeys((*STUDY_ENTRIES, *ENTRIES)), capacity_for(task.robot.nv))
    session = task_session(task)
    session.S.study.step = spacing
    return GoalStudy(robot=task.robot, rows=task.rows, pose=task.goals[0], free=session, limited=session)
