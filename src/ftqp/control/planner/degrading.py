"""Degrading: rows of a task that stays infeasible are given up, set by set, and taken back, by the kernel."""

import logging
from collections.abc import Sequence
from typing import Any, Final, final

from ftqp.control.planner.stages import Stage
from ftqp.control.task.task import ROW_SETS
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import SETS

_LOG = logging.getLogger("ftqp")
PATIENCE: Final = 0.2
"""How long a task is RELAXED, and no nearer, before rows of it are given up [s]."""
SENTENCES: Final = {
    "position_axis": "the task stays infeasible: the rotation about the tool axis is given up",
    "position": "the task stays infeasible: the attitude is given up",
}
BACK: Final = "the rotation about the tool axis is given up, the direction of the tool can be held again"
WHOLE: Final = "the whole task can be held again: all its rows are back"


def fewer_rows(count: int) -> str:
    """What is given up of a task of which so many rows are left, in a sentence."""
    what = "rotation about the tool axis" if count > len(ROW_SETS["position"]) else "attitude"
    return f"the {what} is given up, as the task cannot be held; it comes back as soon as it can"


def allow(K: Any, sets: Sequence[str], dt: float, *, asked: bool) -> None:
    """Write down which rows of the task the kernel may give up."""
    task = K.task
    whole = int(task.m)
    fewer = [name for name in sets if len(ROW_SETS[name]) < whole][:SETS]
    task.sets, task.healthy_too = len(fewer), asked
    task.m_of[0], task.tool_of[0] = whole, task.tool_rows
    for k, name in enumerate(fewer):
        task.m_of[k + 1], task.tool_of[k + 1] = len(ROW_SETS[name]), name == "position_axis"
    task.patience = task.wait = round(PATIENCE / dt)


@final
class Degrading:
    """Says once each when rows of the task are given up, and when they are back."""

    def __init__(self, session: Session, sets: Sequence[str]) -> None:
        self._given_up = session.field("task", "given_up")
        whole = int(session.K.task.m_of[0])
        self._sets = tuple(name for name in sets if len(ROW_SETS[name]) < whole)[:SETS]
        self._said = 0

    @property
    def stage(self) -> Stage:
        """Its part in a planner's life: a reset asks for the whole task again, and nothing is said of it."""
        return Stage(begin=lambda *_: self._forget())

    def _forget(self) -> None:
        self._said = 0

    def tell(self) -> None:
        """Log a change."""
        level = int(self._given_up[0])
        if level == self._said:
            return
        if level > self._said:
            _LOG.warning(SENTENCES[self._sets[level - 1]])
        else:
            _LOG.warning(WHOLE if level == 0 else BACK)
        self._said = level
