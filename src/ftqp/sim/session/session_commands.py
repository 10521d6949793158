"""What a person may ask of a running session: each command is a record, applied between two ticks."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from ftqp.core.checks import FloatArray
from ftqp.faults.kinds import Degraded, Fault, kind_of

TELLS = ("at once", "after", "never", "detector")
"""Ways in which the planner learns of a failure."""
WEAK: Mapping[str, float] = MappingProxyType({"velocity": 0.3, "acceleration": 0.5, "torque": 0.5})
"""What is left of the limits of a joint that is made weak and of which nothing else is said."""


@dataclass(frozen=True, slots=True)
class Break:
    """Let a joint of the real arm fail.

    Attributes:
        joint: Its name or 0-based index.
        kind: A kind of fault, of ``ftqp.faults.kinds.KINDS``.
        settings: Settings of that kind; a degraded joint without any has what `WEAK` leaves.
    """

    joint: str | int
    kind: str = "locked"
    settings: Mapping[str, Any] = field(default_factory=dict)

    def fault(self, joint: str) -> Fault:
        """The fault itself.

        Raises:
            TypeError: The kind has no such setting.
            InputError: There is no such kind, or a setting is out of its range.
        """
        settings = self.settings or (WEAK if self.kind == Degraded.kind else {})
        return kind_of(self.kind)(joint, **settings)


@dataclass(frozen=True, slots=True)
class Repair:
    """Let a joint work again; the planner is told at once.

    Attributes:
        joint: Its name or 0-based index.
    """

    joint: str | int


@dataclass(frozen=True, slots=True)
class Pause:
    """Let time stand, or go on.

    Attributes:
        paused: Whether it stands.
    """

    paused: bool = True


@dataclass(frozen=True, slots=True)
class Reset:
    """Begin anew at tick 0, nothing broken."""


@dataclass(frozen=True, slots=True)
class Speed:
    """Let time go faster or slower.

    Attributes:
        factor: Simulated seconds in a second, > 0; a machine that cannot keep up makes less.
    """

    factor: float


@dataclass(frozen=True, slots=True)
class Use:
    """Take another arm, scenario, scheme or solver, and begin anew; None keeps what there is.

    Attributes:
        robot: The name of a catalog robot.
        scenario: The name or path of a scenario; it takes the place of all earlier choices.
        scheme: The name of a scheme.
        backend: The name of a backend.
        box: Whether a box stands beside the path, which the arm keeps clear of.
    """

    robot: str | None = None
    scenario: str | None = None
    scheme: str | None = None
    backend: str | None = None
    box: bool | None = None


@dataclass(frozen=True, slots=True)
class Tell:
    """How the planner learns of failures from now on.

    Attributes:
        how: ``at once``; ``after`` a delay; ``never``; or by its ``detector``, for which the arm begins anew.
        delay: How long after the failure [s], for ``after``.
    """

    how: str
    delay: float = 0.0


@dataclass(frozen=True, slots=True)
class Aim:
    """Lead the tip by hand.

    Attributes:
        pose: Where the tip shall go, (4, 4) in the frame of the base; None gives the path back.
    """

    pose: FloatArray | None


@dataclass(frozen=True, slots=True)
class LookForWays:
    """Look for ways out of where the arm is, see ``ftqp.Planner.ways_out``.

    Attributes:
        look: False forgets those that were found.
    """

    look: bool = True


@dataclass(frozen=True, slots=True)
class TakeWay:
    """Let the arm go one of the ways that were found.

    Attributes:
        number: Which, from 0 in the order of the facts.
    """

    number: int


@dataclass(frozen=True, slots=True)
class Place:
    """Put the target of a soft task, or something that stands around, elsewhere, until ``Reset``.

    Attributes:
        name: What it is called.
        position: Where to, (3,) in the frame of the base [m].
    """

    name: str
    position: FloatArray


@dataclass(frozen=True, slots=True)
class Seek:
    """Go to another time of a replay.

    Attributes:
        t: Time of the run [s].
    """

    t: float


@dataclass(frozen=True, slots=True)
class Play:
    """Begin anew with one failure to come and none of the scenario's, such as one of a coverage report.

    Attributes:
        joint: Its name or 0-based index; names with a plus sign between them fail together.
        time: When it fails [s]; the planner is told as `Tell` says.
        kind: A kind of fault.
        settings: Settings of that kind.
    """

    joint: str | int
    time: float
    kind: str = "locked"
    settings: Mapping[str, Any] = field(default_factory=dict)


Command = (
    Break | Repair | Pause | Reset | Speed | Use | Tell | Aim | LookForWays | TakeWay | Place | Seek | Play
)
"""Any command."""
