"""What happens to a joint in physics besides the faults that can be reported to a planner.

Nobody announces such a fault: it is what a detector is tried on.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from types import MappingProxyType
from typing import Any, Final

from ftqp.core.checks import array, non_negative
from ftqp.core.errors import InputError
from ftqp.core.setting import setting


@dataclass(frozen=True, slots=True)
class Runaway:
    """The motor gives all its torque in one direction, whatever its servo asks.

    Args:
        joint: The joint's name or its 0-based index.
        direction: 1 or -1, that of the torque.
    """

    joint: str | int
    direction: int = setting(1)

    def __post_init__(self) -> None:
        if self.direction not in (-1, 1):
            raise InputError(f"direction of a runaway joint is {self.direction!r}, expected 1 or -1")


@dataclass(frozen=True, slots=True)
class Weakened:
    """The motor gives a share of whatever its servo asks, at every instant.

    `ftqp.Degraded` lowers the torque limit, which nobody sees before more than that is asked.

    Args:
        joint: The joint's name or its 0-based index.
        share: What is left, >= 0: 0 is a dead motor of which the servo does not know, 1 a healthy one.
    """

    joint: str | int
    share: float = setting(0.5, least=0.0)

    def __post_init__(self) -> None:
        non_negative("share of a weakened motor", self.share)


@dataclass(frozen=True, slots=True)
class Jammed:
    """The brake closes while the motor goes on pushing; `ftqp.Locked` switches the motor off.

    Args:
        joint: The joint's name or its 0-based index.
        share: What the brake holds, as a share of the joint's torque limit, >= 0; with less than the motor
            and its load give the joint slips. None is what the brakes of the arm hold.
    """

    joint: str | int
    share: float | None = setting(None, least=0.0)

    def __post_init__(self) -> None:
        if self.share is not None:
            non_negative("share of a brake", self.share)


@dataclass(frozen=True, slots=True)
class Misread:
    """The encoder that the servo of a joint reads is wrong, so that the servo follows what is not there.

    What a planner is given is the business of `ftqp.JointSensors`. A torque arm has no servo to mislead.

    Args:
        joint: The joint's name or its 0-based index.
        bias: Added to the true position [rad or m].
        frozen: Whether the servo reads the position of now for ever, at rest.
    """

    joint: str | int
    bias: float = setting(0.0, unit="rad or m")
    frozen: bool = setting(False)

    def __post_init__(self) -> None:
        if not isfinite(self.bias):
            raise InputError(f"bias of a misread encoder is {self.bias}, expected a finite angle or length")


@dataclass(frozen=True, slots=True, kw_only=True)
class Push:
    """Something pushes the tip; no joint has failed.

    Args:
        force: Along the axes of the base, (3,) [N].
    """

    force: tuple[float, float, float] = setting((0.0, 0.0, 0.0), unit="N")

    def __post_init__(self) -> None:
        array("force of a push", self.force, (3,))


HiddenFault = Runaway | Weakened | Jammed | Misread
"""Any fault."""
TROUBLES: Final[Mapping[str, type[Any]]] = MappingProxyType(
    {"runaway": Runaway, "weakened": Weakened, "jammed": Jammed, "misread": Misread, "push": Push}
)
"""All of them, and a push, by the names that scenarios give them."""
