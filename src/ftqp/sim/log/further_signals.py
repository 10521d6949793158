"""The signals of soft tasks, kept points and clearances: what a log calls them, and which of them it has."""

from collections.abc import Container, Iterable, Mapping
from typing import Any, Final, NamedTuple

from ftqp.sim.log.signals import Column

TASKS: Final = "task_error"
"""Group of the errors of soft tasks."""
PLANES: Final = "distance"
"""Group of the distances of kept points from their planes and boxes, and of axes from their cones."""
BODIES: Final = "clearance"
"""Group of the distances of the arm from itself and from what stands around it."""
ITSELF: Final = "itself"
"""What stands for the arm's own bodies in that group."""
ROTATION: Final = " rotation"
"""What stands behind the name of a task of a pose where its angle is meant."""
FACTS: Final = {TASKS: "tasks", PLANES: "constraints", BODIES: "scene"}
"""Where the metadata of a log list what a group is of."""


class Measured(NamedTuple):
    """A number that is measured of a soft task or a kept point."""

    group: str  # ``task_error``, ``distance`` or ``clearance``
    name: str  # Of the task, of the kept point, or of what stands around the arm
    unit: str  # Its unit
    about: str  # Its sentence


def further_columns(measured: Iterable[Measured]) -> tuple[Column, ...]:
    """The columns that soft tasks and kept points add, in their order."""
    return tuple(Column(f"{one.group}.{one.name}", one.unit, one.about) for one in measured)


def names_in(rows: Container[str], about: Mapping[str, Any], group: str) -> list[str]:
    """Names of what a log has a signal of, in the order of its soft tasks, or of its kept points.

    A task of a pose has two: its name, and that with ``ROTATION`` behind it.
    """
    named = [one["name"] for one in about.get(FACTS[group], [])]
    every = dict.fromkeys(name for one in named for name in (one, one + ROTATION))
    return [name for name in every if f"{group}.{name}" in rows]
