"""Degrading: rows of the task are given up, set by set, where the task stays infeasible."""

import logging
from collections.abc import Sequence
from typing import Any, Final, final

from ftqp.control.planner.stages import CLOCK, Stage
from ftqp.control.task.task import ROW_SETS
from ftqp.kernel.entry.orders import Orders

_LOG = logging.getLogger("ftqp")
SENTENCES: Final = {
    "position_axis": "the task stays infeasible: the rotation about the tool axis is given up",
    "position": "the task stays infeasible: the attitude is given up",
}


@final
class Degrading:
    """Gives up the rotation about the tool axis, then the attitude, when a task stays infeasible for 0.2 s.

    What has been given up stays so until a reset; the status is RELAXED meanwhile.

    Args:
        orders: The planner's, solved in the kernel.
        sets: The sets of rows that may be kept, the largest first, those of the task among them.
    """

    def __init__(self, orders: Orders, sets: Sequence[str]) -> None:
        self._orders = orders
        whole = int(orders.given.m[0])
        self._sets = tuple(name for name in sets if len(ROW_SETS[name]) < whole)

    @property
    def stage(self) -> Stage:
        """Its part in a planner's life."""
        return Stage(ticks=(CLOCK,), after=self.see)

    def see(self, code: int, _inputs: tuple[Any, ...] = ()) -> None:
        """Count a tick, and give up the next rows when it is time.

        Args:
            code: The tick's status.
            _inputs: What the step was given, which does not matter here.
        """
        if self._orders.give_up(code):
            _LOG.warning(SENTENCES[self._sets[self._orders.given_up - 1]])
