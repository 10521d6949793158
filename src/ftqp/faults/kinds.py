"""The kinds of joint fault that a planner can be told of.

A fault changes the bounds of a joint and never the size of the QP.
"""

from dataclasses import dataclass
from math import isnan

from ftqp.core.checks import non_negative, positive
from ftqp.core.errors import InputError, nearest

MODES = ("ramp", "instant")
RESETS = ("kinematic", "momentum", "task")


def _choice(name: str, got: str, valid: tuple[str, ...]) -> None:
    if got not in valid:
        raise InputError(f"{name} is {got!r}{nearest(str(got), valid)}, expected one of {', '.join(valid)}")


def _share(name: str, value: float) -> None:
    if not 0.0 < positive(name, value) <= 1.0:
        raise InputError(f"{name} is {value:g}, expected a share of the healthy limit in (0, 1]")


@dataclass(frozen=True, slots=True)
class Locked:
    """The joint holds still: its brake has closed.

    Args:
        joint: name or 0-based index.
        mode: ``ramp`` brings it to rest at ``deceleration`` while the others compensate; ``instant`` sets its
            velocity to zero at once, as in Jin et al. 2017.
        deceleration: of the ramp [rad/s2 or m/s2]; None is a quarter of the joint's acceleration limit.
        reset: ``instant`` only: what the velocities of the others do. ``kinematic`` nothing, ``momentum`` a
            free impulse, ``task`` the least jump that keeps the tip's velocity.
    """

    joint: str | int
    mode: str = "ramp"
    deceleration: float | None = None
    reset: str = "kinematic"

    def __post_init__(self) -> None:
        _choice("mode", self.mode, MODES)
        _choice("reset", self.reset, RESETS)
        if self.deceleration is not None:
            positive("deceleration", self.deceleration, "rad/s2")


@dataclass(frozen=True, slots=True)
class FreeSwinging:
    """The joint has lost its motor and its brake: its torque is that of friction alone.

    Args:
        joint: name or 0-based index.
        damping: viscous friction [N m s/rad or N s/m], tau = -damping v.
    """

    joint: str | int
    damping: float = 0.0

    def __post_init__(self) -> None:
        non_negative("damping", self.damping, "N m s/rad")


@dataclass(frozen=True, slots=True)
class Degraded:
    """The joint works, with less.

    Args:
        joint: name or 0-based index.
        velocity, acceleration, torque: share of the healthy limit that is left, in (0, 1].
        q_min, q_max: what is left of its range [rad or m]; None leaves that side as it is.
    """

    joint: str | int
    velocity: float = 1.0
    acceleration: float = 1.0
    torque: float = 1.0
    q_min: float | None = None
    q_max: float | None = None

    def __post_init__(self) -> None:
        for name in ("velocity", "acceleration", "torque"):
            _share(name, getattr(self, name))
        for name in ("q_min", "q_max"):
            value = getattr(self, name)
            if value is not None and isnan(float(value)):
                raise InputError(f"{name} is NaN, expected a joint position")
        if self.q_min is not None and self.q_max is not None and not self.q_min < self.q_max:
            raise InputError(f"q_min {self.q_min:g} is not below q_max {self.q_max:g}")


Fault = Locked | FreeSwinging | Degraded
"""Any fault."""
