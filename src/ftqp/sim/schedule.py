"""When joints really fail, and when the planner is told: the truth that only a simulation knows."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import ceil
from typing import Any, Literal, final

from ftqp.core.checks import instance, non_negative, positive
from ftqp.core.errors import InputError
from ftqp.core.fixed import MADE, Fixed
from ftqp.faults.kinds import Fault, refuse_unknown

NEVER = 2.0**62
"""No run has so many ticks."""
TIME_SLACK = 1e-9
"""Times nearer to each other than this count as equal [s], so that 3 * 0.1 s is 0.3 s."""


@final
@dataclass(frozen=True, slots=True)
class FaultEvent:
    """One joint fails.

    Attributes:
        fault: what happens, and to which joint.
        at: when it happens [s].
        announced: when the planner is told [s]; ``None`` at once, ``"never"`` not at all.

    Raises:
        InputError: no fault, a time that is negative or not finite, or an announcement before the fault.
    """

    fault: Fault
    at: float
    announced: float | Literal["never"] | None = None

    def __post_init__(self) -> None:
        refuse_unknown(self.fault)
        object.__setattr__(self, "at", non_negative("time of the fault", self.at, "s"))
        if self.announced is None or self.announced == "never":
            return
        if not isinstance(self.announced, int | float):
            raise InputError(
                f"announcement of the fault is {self.announced!r}, expected a time in s, "
                "'never', or None for at once"
            )
        told = non_negative("announcement of the fault", self.announced, "s")
        if told < self.at - TIME_SLACK:
            raise InputError(
                f"fault of joint {self.fault.joint} at {self.at:g} s is announced at {told:g} s, "
                "expected no earlier than it happens"
            )
        object.__setattr__(self, "announced", told)

    @property
    def told(self) -> float | None:
        """When the planner is told [s], or ``None`` if never."""
        if self.announced == "never":
            return None
        return self.at if self.announced is None else float(self.announced)


def first_tick(time: float, dt: float) -> int:
    """The first tick k with k dt >= time, the two compared with a slack of 1e-9 s."""
    return max(0, ceil(min((time - TIME_SLACK) / dt, NEVER)))


@final
class Schedule:
    """The faults of a simulation, sorted by time.

    Args:
        events: faults in any order.
    """

    __slots__ = ("_events",)
    events: Fixed[tuple[FaultEvent, ...]] = Fixed("_events", "The faults, in their order.", MADE)

    def __init__(self, events: Iterable[FaultEvent] = ()) -> None:
        instance("events", events, Iterable, "a list of ftqp.FaultEvent")
        events = list(events)
        for event in events:
            instance("an event", event, FaultEvent, "an ftqp.FaultEvent, ftqp.FaultEvent(fault, at=1.0)")
        self._events: tuple[FaultEvent, ...] = tuple(sorted(events, key=lambda event: event.at))

    def __iter__(self) -> Iterator[FaultEvent]:
        return iter(self._events)

    def __len__(self) -> int:
        return len(self._events)

    def failing(self, dt: float) -> dict[int, list[FaultEvent]]:
        """The events by the tick at which they happen.

        Args:
            dt: sampling period [s].
        """
        return _by_tick(((event.at, event) for event in self.events), dt)

    def announced(self, dt: float) -> dict[int, list[FaultEvent]]:
        """The events by the tick at which the planner is told; those never announced are absent.

        Args:
            dt: sampling period [s].
        """
        told = [(event.told, event) for event in self.events if event.told is not None]
        return _by_tick(sorted(told, key=lambda pair: pair[0]), dt)


def _by_tick(pairs: Iterable[tuple[Any, FaultEvent]], dt: float) -> dict[int, list[FaultEvent]]:
    dt = positive("dt", dt, "s")
    ticks: dict[int, list[FaultEvent]] = {}
    for time, event in pairs:
        ticks.setdefault(first_tick(time, dt), []).append(event)
    return ticks
