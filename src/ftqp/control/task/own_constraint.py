"""Kinds of constraints whose rows Python fills in, which somebody adds."""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from ftqp.control.task.own_kinds import refuse_unfinished
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.core.setting import setting
from ftqp.kernel.layout.rows import OWN_ROWS
from ftqp.model.robot import Robot

Fill = Callable[[Any, Any, Any, Any], None]
"""Called before each tick as ``fill(state, C, l, u)``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnConstraint:
    """A kind of constraint of one's own: l <= C x <= u with C, l and u from Python.

    A kind is a frozen dataclass over it whose settings are fields, each a ``setting(...)``, with ``count``
    and ``filling``; an entry of ``CONSTRAINT_KINDS`` in ``ftqp.control.task.task_kinds`` gives it a word in
    scenarios. Logs, reports and the page show its distance where it has a ``unit``; ``about`` says what
    that is.
    CONTRIBUTING.md says more.

    Args:
        name: What ``planner.constraints`` and explanations call it; None is after its kind.

    Raises:
        InputError: A setting is out of its range, ``count`` is no number of rows, or ``filling`` is missing.
    """

    name: str | None = setting(None, "what it is called; after its kind if absent")
    unit: ClassVar[str] = ""
    about: ClassVar[str] = "distance from the boundary, positive where it is kept"

    def __post_init__(self) -> None:
        if self.name is not None and not (isinstance(self.name, str) and self.name):
            raise InputError(f"name is {self.name!r:.60}, expected a word such as 'cable', or None")
        refuse_unfinished(self, OWN_ROWS)

    @property
    def label(self) -> str:
        """What it is called."""
        return self.name or type(self).__name__

    @property
    def rows(self) -> int:
        """How many rows it has."""
        return self.count

    @property
    @abstractmethod
    def count(self) -> int:
        """How many rows it has, 1 to 8, those of all constraints of one's own together."""

    @abstractmethod
    def filling(self, robot: Robot) -> Fill:
        """What fills in C (count, nv), l and u (count,) before each tick, as ``ftqp.Rows`` says.

        Args:
            robot: The arm; an unknown frame or joint is an ``InputError`` here, when the planner is made.
        """

    def distance(self, robot: Robot, q: FloatArray) -> float:
        """How far it is from its boundary, in its ``unit``, negative beyond it.

        Args:
            robot: The arm as it is loaded now.
            q: Joint positions, (nv,) [rad or m].
        """
        return float("nan")
