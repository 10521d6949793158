"""Rows of the task that are given up, set by set, where the task stays infeasible, and taken back."""

from typing import Any

from ftqp.kernel.jit import jit


@jit
def keep_rows(task: Any, terms: Any, qp: Any, level: int) -> None:
    """Reduce the task by so many sets; 0 is the whole task. The tip is drawn to rows that are given up."""
    task.given_up = level
    task.m, task.tool_rows = task.m_of[level], task.tool_of[level]
    task.late = task.held = qp.warm = 0
    terms.count = terms.own + (1 if level > 0 and task.uses_rotation != 0 else 0)


@jit
def restore(task: Any, terms: Any, qp: Any) -> None:
    """The whole task again, as if nothing had been given up."""
    keep_rows(task, terms, qp, 0)
    task.wait = task.patience


@jit
def give_up(task: Any, terms: Any, qp: Any) -> bool:
    """Give up the next set of rows; False where no more may be."""
    if task.given_up >= task.sets:
        return False
    keep_rows(task, terms, qp, task.given_up + 1)
    return True
