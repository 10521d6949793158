"""Degrading: rows of the task are given up, set by set, where the task stays infeasible."""

import logging
from collections.abc import Sequence
from typing import Any, Final, final

from ftqp.control.planner.stages import CLOCK, Stage
from ftqp.control.task.task import ROW_SETS
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import OK, RELAXED, SCALED

_LOG = logging.getLogger("ftqp")
PATIENCE: Final = 0.2
"""How long a task is RELAXED before rows of it are given up [s]."""
SENTENCES: Final = {
    "position_axis": "the task stays infeasible: the rotation about the tool axis is given up",
    "position": "the task stays infeasible: the attitude is given up",
}


@final
class Degrading:
    """Gives up the rotation about the tool axis, then the attitude, when a task stays infeasible for 0.2 s.

    What has been given up stays so until ``restore``; the status is RELAXED meanwhile.

    Args:
        session: The planner's, solved in the kernel.
        sets: The sets of rows that may be kept, the largest first, those of the task among them.
    """

    def __init__(self, session: Session, sets: Sequence[str]) -> None:
        K = session.K
        self._task, self._cascade = K.task, K.cascade
        self._whole = int(K.task.m), int(K.task.tool_rows)
        self._sets = tuple(name for name in sets if len(ROW_SETS[name]) < self._whole[0])
        self._most = round(PATIENCE / float(K.state.dt))
        self._late = 0

    @property
    def stage(self) -> Stage:
        """Its part in a planner's life."""
        return Stage(ticks=(CLOCK,), after=self.see, begin=lambda *_: self.restore())

    def see(self, code: int, _inputs: tuple[Any, ...] = ()) -> None:
        """Count a tick, and give up the next rows when it is time.

        Args:
            code: The tick's status.
            _inputs: What the step was given, which does not matter here.
        """
        task = self._task
        if code == RELAXED and self._cascade.missed:
            self._late += 1
            if self._late > self._most and task.given_up < len(self._sets):
                name = self._sets[task.given_up]
                task.given_up += 1
                self._late = 0
                task.m, task.tool_rows = len(ROW_SETS[name]), name == "position_axis"
                _LOG.warning(SENTENCES[name])
        elif code in (OK, RELAXED, SCALED):
            self._late = 0

    def restore(self) -> None:
        """The whole task again."""
        self._task.m, self._task.tool_rows = self._whole
        self._late = self._task.given_up = 0
