"""Rows of the task are given up, set by set, where the task stays infeasible."""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import OK, RELAXED, SCALED


@jit
def give_up(task: Any, cascade: Any, given: Any, code: int) -> bool:
    """Count a tick of this status; whether it was time to give up the next rows."""
    if code == RELAXED and cascade.missed:
        given.late += 1
        if given.late > given.patience and task.given_up < given.sets:
            task.given_up += 1
            given.late = 0
            task.m, task.tool_rows = given.m[task.given_up], given.tool_rows[task.given_up]
            return True
    elif code == OK or code == RELAXED or code == SCALED:
        given.late = 0
    return False


@jit
def restore(task: Any, given: Any) -> None:
    """The whole task again."""
    task.m, task.tool_rows = given.m[0], given.tool_rows[0]
    given.late = task.given_up = 0
