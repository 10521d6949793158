"""A kind of fault that only ``ftqp.faults.kinds`` knows, and what every consumer makes of it, as JSON.

Run as a process of its own: the kind goes into the table before anything else of ftqp reads it.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from ftqp.faults import kinds


@dataclass(frozen=True, slots=True)
class Sticky:
    """The joint sticks."""

    kind: ClassVar[str] = "sticky"
    happens: ClassVar[str] = "sticks"
    number: ClassVar[int] = 1 + max(kind.number for kind in kinds.KINDS.values())
    works: ClassVar[bool] = False
    shares: ClassVar[Mapping[str, str]] = kinds.NOTHING
    button: ClassVar[str] = "stick"
    judged: ClassVar[str] = "sticky"
    colour: ClassVar[str] = "#112233"
    live_colour: ClassVar[str] = "#445566"

    joint: str | int
    grip: float = kinds.setting(1.0, "how hard, > 0", unit="N m", above=0.0)


@dataclass(frozen=True, slots=True)
class Unheard:
    """A kind that is in no table."""

    joint: str | int


if __name__ == "__main__":
    folder, registered = Path(sys.argv[1]), sys.argv[2] == "registered"
    if registered:
        kinds.KINDS = kinds.table_of(*kinds.KINDS.values(), Sticky)
    from tests.laws.consumers_of_kinds import main

    main(folder, Sticky if registered else Unheard, registered)
