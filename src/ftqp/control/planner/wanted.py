"""What a planner was told since it was made, in one immutable object."""

from collections.abc import Callable
from dataclasses import dataclass

from ftqp.control.planner.braking_reserve import BrakingReserve
from ftqp.control.planner.fitting import Fitting
from ftqp.core.checks import FloatArray
from ftqp.faults.belief import Belief


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """Where the arm begins.

    Attributes:
        q: Joint positions, (nv,) [rad or m].
        v: Joint velocities, (nv,) [rad/s or m/s].
    """

    q: FloatArray
    v: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Wanted:
    """All that a planner was told.

    Attributes:
        belief: Which joints have failed.
        fitting: The arm with its load and tool.
        reserve: The deceleration that its motors have; None where torque is not limited.
        start: Where the arm begins; None before the first ``reset``.
        speed: How fast the arm is led, in (0, 1] of full speed.
        then: What else the last change brings about, as often as it is called; None is nothing.
    """

    belief: Belief
    fitting: Fitting
    reserve: BrakingReserve | None
    start: Start | None = None
    speed: float = 1.0
    then: Callable[[], None] | None = None
