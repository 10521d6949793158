"""What a person may ask of a running session: each command is a record, applied between two ticks."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from ftqp.core.checks import FloatArray

TELLS = ("at once", "after", "never", "detector")
"""Ways in which the planner learns of a failure."""
WEAK: Mapping[str, float] = MappingProxyType({"velocity": 0.3, "acceleration": 0.5, "torque": 0.5})
"""What is left of the limits of a joint that is made weak and of which nothing else is said."""


@dataclass(frozen=True, slots=True)
class Break:
    """Let a joint of the real arm fail, by its name or 0-based index."""

    joint: str | int
    kind: str = "locked"  # One of ``ftqp.faults.kinds.KINDS``
    settings: Mapping[str, Any] = field(default_factory=dict)  # A degraded joint without any: `WEAK`


@dataclass(frozen=True, slots=True)
class Play:
    """Begin anew with one failure to come and none of the scenario's, such as one of a coverage report."""

    joint: str | int  # Names with a plus sign between them fail together
    time: float  # When [s]
    kind: str = "locked"
    settings: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Repair:
    """Let a joint work again, by its name or 0-based index; that is reported at once."""

    joint: str | int


@dataclass(frozen=True, slots=True)
class Pause:
    """Let time stand, or go on."""

    paused: bool = True


@dataclass(frozen=True, slots=True)
class Reset:
    """Begin anew at tick 0, nothing broken."""


@dataclass(frozen=True, slots=True)
class Speed:
    """Let so many simulated seconds, > 0, go by in a second; a machine that cannot keep up makes less."""

    factor: float


@dataclass(frozen=True, slots=True)
class Seek:
    """Go to another time of a replay [s]."""

    t: float


@dataclass(frozen=True, slots=True)
class Use:
    """Take another arm, scheme, solver, or a box, by name; a scenario takes the place of earlier choices."""

    robot: str | None = None
    scenario: str | None = None
    scheme: str | None = None
    backend: str | None = None
    box: bool | None = None


@dataclass(frozen=True, slots=True)
class Tell:
    """How the planner learns of failures from now on; for its ``detector`` the arm begins anew."""

    how: str  # One of `TELLS`
    delay: float = 0.0  # Of ``after`` [s]


@dataclass(frozen=True, slots=True)
class Aim:
    """Lead the tip by hand to a pose, (4, 4) in the frame of the base; None gives the path back."""

    pose: FloatArray | None


@dataclass(frozen=True, slots=True)
class LookForWays:
    """Look for ways out of where the arm is, see ``ftqp.Planner.ways_out``, or forget those found."""

    look: bool = True


@dataclass(frozen=True, slots=True)
class TakeWay:
    """Let the arm go one of the ways that were found, from 0 in the order of the frame."""

    number: int


@dataclass(frozen=True, slots=True)
class Place:
    """Put the target of a task, or what stands around, to (3,) in the base's frame [m], until ``Reset``."""

    name: str
    position: FloatArray


Command = (
    Break | Repair | Pause | Reset | Speed | Use | Tell | Aim | LookForWays | TakeWay | Place | Seek | Play
)
"""Any command."""
