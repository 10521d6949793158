"""Tasks whose rows Python fills in: a function of one's own, and kinds that somebody adds."""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from ftqp.control.task.soft_tasks import SoftTask
from ftqp.core.checks import FloatArray, whole_number
from ftqp.core.errors import InputError
from ftqp.core.setting import refuse_out_of_range, setting
from ftqp.kernel.layout.enums import TASK_ROWS
from ftqp.kernel.layout.rows import OWN_ROWS
from ftqp.kernel.layout.scene_room import OWN
from ftqp.model.robot import Robot

Fill = Callable[[Any, Any, Any], None]
"""Called before each tick as ``fill(state, J, b)``."""
FillRows = Callable[[Any, Any, Any, Any], None]
"""Called before each tick as ``fill(state, C, l, u)``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnTask(SoftTask):
    """A kind of task of one's own: weight/2 |J x - b|^2, or J x = b on level 0, with J and b from Python.

    A kind is a frozen dataclass over it whose settings are fields, each a ``setting(...)``, with ``count``
    and ``filling``; an entry of ``KINDS`` in ``ftqp.control.task.keep`` gives it a word in scenarios.
    Logs, reports and the page show its error where it has a ``unit``. ``about`` says what that error is.
    CONTRIBUTING.md says more.

    Raises:
        InputError: A setting is out of its range, ``count`` is no number of rows, or ``filling`` is missing.
    """

    code: ClassVar[int] = OWN
    unit: ClassVar[str] = ""
    about: ClassVar[str] = "error of the task"

    def __post_init__(self) -> None:
        SoftTask.__post_init__(self)
        refuse_unfinished(self, TASK_ROWS)

    @property
    @abstractmethod
    def count(self) -> int:
        """How many rows it has, 1 to 6."""

    @abstractmethod
    def filling(self, robot: Robot) -> Fill:
        """What fills in J (count, nv) and b (count,) before each tick, as ``LeastSquares`` says.

        Args:
            robot: The arm; an unknown frame or joint is an ``InputError`` here, when the planner is made.
        """

    def error(self, robot: Robot, q: FloatArray) -> float:
        """How far it is from what it asks for, in its ``unit``, >= 0.

        Args:
            robot: The arm as it is loaded now.
            q: Joint positions, (nv,) [rad or m].
        """
        return float("nan")

    def place(self, robot: Robot, q: FloatArray) -> FloatArray | None:
        """Where its target is, (3,) [m], for the page to mark; None of a task without a place.

        Args:
            robot: The arm.
            q: Joint positions, (nv,) [rad or m].
        """
        return None


@dataclass(frozen=True, slots=True)
class LeastSquares(OwnTask):
    """weight/2 |J x - b|^2 of one's own, or J x = b on level 0, at the price of a call in every step.

    Args:
        rows: How many rows, 1 to 6.
        fill: Called before each tick as ``fill(state, J, b)``: ``state`` has ``q``, ``v`` and ``a`` of the
            reference, (nv,), ``level`` and ``dt`` [s], and ``J`` (rows, nv) and ``b`` (rows,) are to be
            written. x is the joint acceleration, or velocity at the velocity level. It is tried once when a
            planner is made, at the neutral posture at rest. A tick in which it raises or gives numbers that
            are not finite goes on without the task; ``step.tasks[name].failed`` says why, and the first
            time a warning does. One that takes longer than a tick is named once on the logger ``ftqp``.
    """

    rows: int
    fill: Fill

    def __post_init__(self) -> None:
        SoftTask.__post_init__(self)
        whole_number(f"rows of {self.label}", self.rows, 1, TASK_ROWS)
        if not callable(self.fill):
            raise InputError(f"fill of {self.label} is {self.fill!r:.60}, expected a function (state, J, b)")

    @property
    def count(self) -> int:
        """How many rows it has."""
        return self.rows

    def filling(self, robot: Robot) -> Fill:
        """The function.

        Args:
            robot: The arm, which the function does not need.
        """
        return self.fill


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnConstraint:
    """A kind of constraint of one's own: l <= C x <= u with C, l and u from Python.

    A kind is a frozen dataclass over it whose settings are fields, each a ``setting(...)``, with ``count``
    and ``filling``; an entry of ``CONSTRAINT_KINDS`` in ``ftqp.control.task.keep`` gives it a word in
    scenarios. Logs, reports and the page show its distance where it has a ``unit``; ``about`` says what
    that is.
    CONTRIBUTING.md says more.

    Args:
        name: What ``planner.constraints`` and explanations call it; None is after its kind.

    Raises:
        InputError: A setting is out of its range, ``count`` is no number of rows, or ``filling`` is missing.
    """

    name: str | None = setting(None)
    called: ClassVar[str] = ""
    unit: ClassVar[str] = ""
    about: ClassVar[str] = "distance from the boundary, positive where it is kept"

    def __post_init__(self) -> None:
        if self.name is not None and not (isinstance(self.name, str) and self.name):
            raise InputError(f"name is {self.name!r:.60}, expected a word such as 'cable', or None")
        refuse_unfinished(self, OWN_ROWS)

    @property
    def label(self) -> str:
        """What it is called."""
        return self.name or self.called or type(self).__name__

    @property
    @abstractmethod
    def count(self) -> int:
        """How many rows it has, 1 to 8, those of all constraints of one's own together."""

    @abstractmethod
    def filling(self, robot: Robot) -> FillRows:
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


@dataclass(frozen=True, slots=True)
class Rows(OwnConstraint):
    """l <= C x <= u of one's own, at the price of a call in every step.

    They go before the task of the end effector, which gives way as its mode says. x is the joint
    acceleration, or the velocity at the velocity level.

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
    fill: FillRows
    called: ClassVar[str] = "rows"

    def __post_init__(self) -> None:
        OwnConstraint.__post_init__(self)
        if not callable(self.fill):
            raise InputError(
                f"fill of {self.label} is {self.fill!r:.60}, expected a function (state, C, l, u)"
            )

    @property
    def count(self) -> int:
        """How many rows it has."""
        return self.rows

    def filling(self, robot: Robot) -> FillRows:
        """The function.

        Args:
            robot: The arm, which the function does not need.
        """
        return self.fill


def refuse_unfinished(made: Any, most: int) -> None:
    """Refuse one whose settings are not as they say, whose ``count`` is none, or that lacks ``filling``."""
    kind = type(made).__name__
    for name in ("count", "filling"):
        if getattr(getattr(type(made), name), "__isabstractmethod__", False):
            what = "a property" if name == "count" else "a method filling(robot)"
            raise InputError(f"{kind} has no {name}, expected {what}, as CONTRIBUTING.md shows")
    refuse_out_of_range(made, f" of {made.label}", every=True)
    whole_number(f"count of {made.label}", made.count, 1, most)
