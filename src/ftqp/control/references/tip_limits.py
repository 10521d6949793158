"""How fast a reference of the tip may move."""

from dataclasses import dataclass

from ftqp.control.references.jerk_limit import RISE_TIME
from ftqp.core.checks import positive


@dataclass(frozen=True, slots=True, kw_only=True)
class TipLimits:
    """Limits of the reference that leads the tip to a goal; the arm's own limits hold beside them.

    Args:
        speed: The largest linear speed, > 0 [m/s]. A larger one arrives sooner.
        acceleration: The largest linear acceleration, > 0 [m/s2]. A larger one starts and brakes harder.
        turn: The largest angular speed, > 0 [rad/s].
        turn_acceleration: The largest angular acceleration, > 0 [rad/s2].
        rise_time: How long an acceleration takes to reach its limit, > 0 [s], which limits the jerk. A longer
            one is softer and later.

    Raises:
        InputError: A limit is not positive or not finite.
    """

    speed: float = 0.5
    acceleration: float = 2.0
    turn: float = 1.5
    turn_acceleration: float = 6.0
    rise_time: float = RISE_TIME

    def __post_init__(self) -> None:
        for name, unit in (
            ("speed", "m/s"),
            ("acceleration", "m/s2"),
            ("turn", "rad/s"),
            ("turn_acceleration", "rad/s2"),
            ("rise_time", "s"),
        ):
            positive(name, getattr(self, name), unit)
