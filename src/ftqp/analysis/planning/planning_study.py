"""Compiled studies of a task for planning: nodes on its self-motions, and Newton steps onto its path."""

from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.survival.continuing import task_session
from ftqp.analysis.survival.task_path import TaskPath


def planning_study(task: TaskPath, spacing: float) -> GoalStudy:
    """Studies within the arm's limits of a task's rows; the goal is the first sample.

    Args:
        task: The task.
        spacing: Largest step along a self-motion [rad or m].
    """
    session = task_session(task)
    session.S.study.step = spacing
    return GoalStudy(robot=task.robot, rows=task.rows, pose=task.goals[0], free=session, limited=session)
