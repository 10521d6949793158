"""Whether it is time to give up rows of a task that stays infeasible, or to take some back."""

from typing import Any

from ftqp.kernel.jit import rare_jit
from ftqp.kernel.latches.giving_up import give_up, keep_rows
from ftqp.kernel.layout.enums import RELAXED
from ftqp.kernel.rows.rows_given_up import is_whole, more_rows_hold

NEARER = 0.99
"""A task whose error is below this share of the least one so far is still being approached. A guess that
tests/control/planner/test_degrading.py has not contradicted."""
LONGEST = 64
"""Rows are taken back after so many times the patience at most: it doubles whenever they come back. A
convention."""


@rare_jit
def count_rows(K: Any, status: int) -> None:
    """After a tick of this status: the next set of rows is given up, or the last one taken back.

    Rows are given up where that was asked for, ``healthy_too``, the task has been infeasible for ``patience``
    ticks, and its error has not become less; beside a joint that swings freely unasked, and also where it
    has. They come back after ``wait`` ticks in which they could be held.
    """
    task, terms = K.task, K.terms
    swings = K.faults.movable > K.faults.working
    if status != RELAXED:
        task.late = task.held = 0
        return
    if task.given_up > 0:
        held = K.cascade.missed == 0 and more_rows_hold(K)
        task.held = task.held + 1 if held else 0
        if task.held > task.wait:
            keep_rows(task, terms, K.qp, 0 if is_whole(K) else task.given_up - 1)
            task.wait = min(2 * task.wait, LONGEST * task.patience)
            return
    if K.cascade.missed == 0 or (task.healthy_too == 0 and not swings):
        task.late = 0
        return
    feedback = K.feedback
    e = task.position_error / feedback.tolerance + task.rotation_error / feedback.rotation_tolerance
    if task.late == 0:
        task.nearest = e
    elif e < NEARER * task.nearest and not swings:
        task.nearest, task.late = e, 0
    task.late += 1
    if task.late > task.patience:
        give_up(task, terms, K.qp)
