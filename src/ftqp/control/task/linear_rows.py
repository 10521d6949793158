"""Rows: linear constraints of the user's own."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ftqp.core.errors import InputError
from ftqp.kernel.layout.rows import OWN_ROWS
from ftqp.model.robot import Robot


@dataclass(frozen=True, slots=True)
class Rows:
    """l <= C x <= u of one's own, at the price of a call in every step.

    They go before the task of the tip, which gives way as its mode says. x is the joint acceleration, or the
    velocity at the velocity level.

    Args:
        rows: How many rows, 1 to 8, those of all ``Rows`` of a planner together.
        fill: Called before each tick as ``fill(state, C, l, u)``: ``state`` has ``q``, ``v`` and ``a`` of
            the reference, (nv,), ``level`` and ``dt`` [s], and ``C`` (rows, nv), ``l`` and ``u`` (rows,)
            are to be written; they hold 0, -inf and inf before. Where it raises, leaves a number that is
            not finite in ``C``, NaN in the others, or l > u, nothing is known of the constraint any more,
            and the planner stops the arm.
        name: What ``planner.constraints`` and explanations call it.

    Raises:
        InputError: ``rows`` is no number of rows, or ``fill`` no function.
    """

    rows: int
    fill: Callable[[Any, Any, Any, Any], None]
    name: str = "rows"

    def __post_init__(self) -> None:
        if not (isinstance(self.name, str) and self.name):
            raise InputError(f"name is {self.name!r:.60}, expected a word such as 'cable'")
        if isinstance(self.rows, bool) or not isinstance(self.rows, int) or not 1 <= self.rows <= OWN_ROWS:
            raise InputError(f"rows of {self.name} is {self.rows!r:.60}, expected 1 to {OWN_ROWS}")
        if not callable(self.fill):
            raise InputError(
                f"fill of {self.name} is {self.fill!r:.60}, expected a function (state, C, l, u)"
            )

    @property
    def label(self) -> str:
        """What it is called."""
        return self.name

    def filling(self, robot: Robot) -> Callable[[Any, Any, Any, Any], None]:
        """The function.

        Args:
            robot: The arm, which the function does not need.
        """
        return self.fill
