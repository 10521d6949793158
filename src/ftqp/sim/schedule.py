"""When joints really fail, and when that is reported: the truth that only a simulation knows."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import ceil
from typing import Any, Literal, cast, final, overload
from warnings import warn

from ftqp.core.checks import instance, non_negative, positive
from ftqp.core.errors import InputError
from ftqp.core.fixed import MADE, Fixed
from ftqp.faults.kinds import KINDS, Fault, refuse_unknown
from ftqp.kernel.layout.thresholds import TIME_SLACK

NEVER = 2.0**62
"""No run has so many ticks."""


Announced = float | Literal["never"] | None
"""When it is reported to the planner [s]; ``None`` at once, ``"never"`` not at all."""
FIELDS, ONCE = ("at", "fault", "announced"), ("fault", "at", "announced")
"""The order of what an event is made with, and that of earlier versions."""


@final
@dataclass(frozen=True, slots=True, init=False)
class FaultEvent:
    """One joint fails: ``FaultEvent(2.0, Locked("j3"))``.

    Attributes:
        at: When it happens [s].
        fault: What happens, and to which joint.
        announced: When it is reported to the planner [s]; ``None`` at once, ``"never"`` not at all.

    Raises:
        InputError: No fault, a time that is negative or not finite, or an announcement before the fault.
    """

    at: float
    fault: Fault
    announced: Announced

    @overload
    def __init__(self, at: float, fault: Fault, announced: Announced = None) -> None: ...
    @overload
    def __init__(self, fault: Fault, at: float, announced: Announced = None) -> None: ...
    def __init__(self, *given: Any, **named: Any) -> None:
        parts = _named(given, named)
        refuse_unknown(parts["fault"])
        object.__setattr__(self, "fault", parts["fault"])
        object.__setattr__(self, "at", non_negative("time of the fault", parts["at"], "s"))
        object.__setattr__(self, "announced", self._reported_at(parts.get("announced")))

    def _reported_at(self, announced: Any) -> Announced:
        """When it is reported, checked."""
        if announced is None or announced == "never":
            return cast("Announced", announced)
        if not isinstance(announced, int | float):
            raise InputError(
                f"announcement of the fault is {announced!r}, expected a time in s, "
                "'never', or None for at once"
            )
        reported_at = non_negative("announcement of the fault", announced, "s")
        if reported_at < self.at - TIME_SLACK:
            raise InputError(
                f"fault of joint {self.fault.joint} at {self.at:g} s is announced at {reported_at:g} s, "
                "expected no earlier than it happens"
            )
        return reported_at

    @property
    def told(self) -> float | None:
        """`reported_at`, as it was called before 0.4."""
        warn("the time of a report is FaultEvent.reported_at now", DeprecationWarning, stacklevel=2)
        return self.reported_at

    @property
    def reported_at(self) -> float | None:
        """When it is reported to the planner [s], or ``None`` if never."""
        if self.announced == "never":
            return None
        return self.at if self.announced is None else float(self.announced)


def _named(given: tuple[Any, ...], named: dict[str, Any]) -> dict[str, Any]:
    """What an event is made with, by name; of the order of earlier versions a warning says so."""
    order = FIELDS
    if given and isinstance(given[0], tuple(KINDS.values())):
        order = ONCE
        warn(
            "FaultEvent(fault, at) is the order of earlier versions; write FaultEvent(at, fault)",
            DeprecationWarning,
            stacklevel=3,
        )
    parts = dict(zip(order, given, strict=False)) | named
    twice = len(given) + len(named) - len(parts)
    missing = [name for name in FIELDS[:2] if name not in parts]
    if twice or missing or not set(parts) <= set(FIELDS):
        raise TypeError(
            f"FaultEvent takes at, fault and announced, each once; got {len(given)} without a name and "
            f"{', '.join(named) or 'none'} by name"
        )
    return parts


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
            instance("an event", event, FaultEvent, "an ftqp.FaultEvent, ftqp.FaultEvent(1.0, fault)")
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
        """The events by the tick at which they are reported; those never announced are absent.

        Args:
            dt: sampling period [s].
        """
        reported = [(event.reported_at, event) for event in self.events if event.reported_at is not None]
        return _by_tick(sorted(reported, key=lambda pair: pair[0]), dt)


def _by_tick(pairs: Iterable[tuple[Any, FaultEvent]], dt: float) -> dict[int, list[FaultEvent]]:
    dt = positive("dt", dt, "s")
    ticks: dict[int, list[FaultEvent]] = {}
    for time, event in pairs:
        ticks.setdefault(first_tick(time, dt), []).append(event)
    return ticks
