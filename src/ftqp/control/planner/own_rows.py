"""Rows of soft tasks that functions of the user fill in before every tick."""

import logging
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, final

import numpy as np

from ftqp.control.planner.step_parts import Reference
from ftqp.control.task.soft_tasks import LeastSquares
from ftqp.core.checks import FloatArray, frozen
from ftqp.core.errors import InputError

_LOG = logging.getLogger("ftqp")
LETTERS = 120
"""So much of an exception's text is told."""


class _Own(NamedTuple):
    name: str
    task: LeastSquares
    J: FloatArray
    b: FloatArray


@final
class OwnRows:
    """Asks the user's functions for their rows; one that fails leaves its task out of that tick.

    Args:
        terms: The room of the planner's record that the rows are written into.
        tasks: Place, name and task of each.
        neutral: The posture at which each is tried, (nv,) [rad or m].
        seen: The state that they are shown in every tick.

    Attributes:
        failed: Why a task was left out of the last tick, by name; none where all were good.

    Raises:
        InputError: A function raises, gives no numbers, or returns something, at the neutral posture at rest.
    """

    __slots__ = ("_all", "_seen", "_warned", "failed")

    def __init__(
        self, terms: Any, tasks: Sequence[tuple[int, str, LeastSquares]], neutral: FloatArray, seen: Reference
    ) -> None:
        n, self._seen = len(neutral), seen
        self.failed: dict[str, str] = {}
        self._warned: set[str] = set()
        still = Reference(frozen(neutral.copy()), frozen(np.zeros(n)), frozen(np.zeros(n)))
        for _, name, task in tasks:
            why = _tried(task, still, np.zeros((task.rows, n)), np.zeros(task.rows))
            if why:
                raise InputError(
                    f"fill of {name} {why} at the neutral posture at rest, expected that it writes finite "
                    f"numbers into J ({task.rows}, {n}) and b ({task.rows},) and returns nothing"
                )
        self._all = tuple(
            _Own(name, task, terms.J[at, : task.rows, :n], terms.b[at, : task.rows])
            for at, name, task in tasks
        )

    def fill(self) -> None:
        """Fill in all rows, those of a function that fails with zeros. Ctrl-C goes through."""
        for name, task, J, b in self._all:
            J[:] = b[:] = 0.0
            try:
                why = _tried(task, self._seen, J, b)
            except BaseException:
                J[:] = b[:] = 0.0
                raise
            if why:
                J[:] = b[:] = 0.0
                self.failed[name] = f"fill {why}, so that {name} was left out of the tick"
                if name not in self._warned:
                    self._warned.add(name)
                    _LOG.warning("%s; this is told once", self.failed[name])
            else:
                self.failed.pop(name, None)


def _tried(task: LeastSquares, state: Reference, J: FloatArray, b: FloatArray) -> str:
    """Call a function; what is wrong with it, or nothing."""
    fill: Callable[..., object] = task.fill
    try:
        returned = fill(state, J, b)
    except Exception as error:  # whatever it is, the arm goes on without the task
        return f"raised {type(error).__name__}: {error!s:.{LETTERS}}"
    if returned is not None:
        return f"returned {type(returned).__name__}"
    return "" if np.isfinite(J).all() and np.isfinite(b).all() else "gave numbers that are not finite"
