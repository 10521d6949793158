"""The kinds of joint fault that can be reported to a planner.

A fault changes the bounds of a joint and never the size of the QP. This file is the one table of kinds:
scenarios, logs, figures, the live page, campaigns and messages read what they need from the classes below and
from ``KINDS``, and whoever does something of its own for each kind matches over them and ends in
``not_served``: mypy finds the place that forgot a kind, and at run time it says so in a sentence.

Each kind has a name in files (``kind``), a verb for messages (``happens``), a number in logs (``number``);
``works`` says whether the joint still follows its commands, within limits that may be lower, and ``shares``
which of its settings is the share left of which limit: ``v_max``, ``a_max`` or ``tau_max``. ``button`` is the
word on its button of the live page, ``judged`` its name in ``ftqp.checker``, ``colour`` that of figures, and
``live_colour`` that of the live page.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isnan
from types import MappingProxyType
from typing import Any, ClassVar, Never, NoReturn

from ftqp.core.checks import as_number, positive
from ftqp.core.errors import InputError, unknown
from ftqp.core.setting import refuse_out_of_range, setting

MODES = ("ramp", "instant")
RESETS = ("kinematic", "momentum", "task")
NOTHING: Mapping[str, str] = MappingProxyType({})
"""The ``shares`` of a kind that leaves no limit lower than before."""


@dataclass(frozen=True, slots=True)
class Locked:
    """The joint holds still: its brake has closed.

    Args:
        joint: The joint's name or its 0-based index.
        mode: How it comes to rest: by ``ramp`` it brakes at ``deceleration`` while the rest compensate;
            ``instant`` sets its velocity to zero at once, as in Jin et al. 2017, and the end effector leaves
            its path by more.
        deceleration: Braking of the ramp, > 0 [rad/s2 or m/s2]. A larger one stops the joint sooner and asks
            more of the remaining joints at that moment. None is a quarter of the joint's acceleration limit.
        reset: What the remaining joints' velocities do at an ``instant`` lock: ``kinematic`` leaves them,
            ``momentum`` changes them by a free impulse, ``task`` by the least jump that keeps the end
            effector's velocity.
    """

    kind: ClassVar[str] = "locked"
    happens: ClassVar[str] = "locks"
    button: ClassVar[str] = "lock"
    judged: ClassVar[str] = "locked"
    colour: ClassVar[str] = "#D55E00"
    live_colour: ClassVar[str] = "#D62728"
    number: ClassVar[int] = 1
    works: ClassVar[bool] = False
    shares: ClassVar[Mapping[str, str]] = NOTHING

    joint: str | int
    mode: str = setting("ramp", choices=MODES)
    deceleration: float | None = setting(None, unit="rad/s2 or m/s2", above=0.0)
    reset: str = setting("kinematic", choices=RESETS)

    def __post_init__(self) -> None:
        refuse_out_of_range(self)


@dataclass(frozen=True, slots=True)
class FreeSwinging:
    """The joint has lost its motor and its brake: friction and its end stops are all that is left.

    A planner only measures the joint at first, and counts it as swinging once it is seen to; with torque
    drives it counts as swinging at once.

    Args:
        joint: The joint's name or its 0-based index.
        damping: Viscous friction on top of the robot's own, >= 0 [N m s/rad or N s/m]: tau = -damping v. The
            more friction, the sooner the joint that is believed to swing comes to rest; an estimate that is
            too high promises a joint that is too steady.
        friction: Coulomb friction on top of the robot's own, >= 0 [N m or N]. The more of it, the farther
            from the posture in which it hangs the joint can rest; an estimate that is too high leaves it
            falling.
    """

    kind: ClassVar[str] = "free_swinging"
    happens: ClassVar[str] = "swings freely"
    button: ClassVar[str] = "free"
    judged: ClassVar[str] = "free"
    colour: ClassVar[str] = "#CC79A7"
    live_colour: ClassVar[str] = "#F08C14"
    number: ClassVar[int] = 2
    works: ClassVar[bool] = False
    shares: ClassVar[Mapping[str, str]] = NOTHING

    joint: str | int
    damping: float = setting(0.0, unit="N m s/rad", least=0.0)
    friction: float = setting(0.0, unit="N m", least=0.0)

    def __post_init__(self) -> None:
        refuse_out_of_range(self)


@dataclass(frozen=True, slots=True)
class Degraded:
    """The joint works, with less speed, acceleration, torque or range.

    Args:
        joint: The joint's name or its 0-based index.
        velocity: Share of the healthy speed limit that is left, in (0, 1].
        acceleration: Share of the healthy acceleration limit that is left, in (0, 1]; a small one can make a
            stop before a position limit impossible.
        torque: Share of the healthy torque limit that is left, in (0, 1].
        q_min: The smallest position that is left [rad or m]; None leaves that side as it is.
        q_max: The largest position that is left [rad or m]; None leaves that side as it is.
    """

    kind: ClassVar[str] = "degraded"
    happens: ClassVar[str] = "is degraded"
    button: ClassVar[str] = "weak"
    judged: ClassVar[str] = "degraded"
    colour: ClassVar[str] = "#F0E442"
    live_colour: ClassVar[str] = "#9452C8"
    number: ClassVar[int] = 3
    works: ClassVar[bool] = True
    shares: ClassVar[Mapping[str, str]] = MappingProxyType(
        {"v_max": "velocity", "a_max": "acceleration", "tau_max": "torque"}
    )

    joint: str | int
    velocity: float = setting(1.0, above=0.0, most=1.0)
    acceleration: float = setting(1.0, above=0.0, most=1.0)
    torque: float = setting(1.0, above=0.0, most=1.0)
    q_min: float | None = setting(None, unit="rad or m")
    q_max: float | None = setting(None, unit="rad or m")

    def __post_init__(self) -> None:
        for name in ("velocity", "acceleration", "torque"):
            if (share := positive(name, getattr(self, name))) > 1.0:
                raise InputError(f"{name} is {share:g}, expected a share of the healthy limit in (0, 1]")
        for name in ("q_min", "q_max"):
            value = getattr(self, name)
            if value is not None and isnan(as_number(name, value, "rad or m")):
                raise InputError(f"{name} is NaN, expected a joint position")
        if self.q_min is not None and self.q_max is not None and not self.q_min < self.q_max:
            raise InputError(f"q_min {self.q_min:g} is not below q_max {self.q_max:g}")


SWINGS = "reporting a free-swinging joint needs"
"""The beginning of the sentence that refuses a robot with branches; one without a report goes on."""

Fault = Locked | FreeSwinging | Degraded
"""Any fault."""
FACTS = ("kind", "happens", "number", "works", "shares", "button", "judged", "colour", "live_colour")
"""What every kind says of itself ..."""
OWN = ("kind", "number", "button", "colour", "live_colour")
"""... and what no two may have in common."""
RECIPE = "CONTRIBUTING.md, 'Add a kind of fault'"


def table_of(*kinds: type[Fault]) -> Mapping[str, type[Fault]]:
    """Kinds by their names."""
    for kind in kinds:
        left_out = [fact for fact in FACTS if getattr(kind, fact, None) is None]
        if left_out:
            raise InputError(
                f"the kind of fault {kind.__name__} has no {', '.join(left_out)}, expected all of "
                f"{', '.join(FACTS)}; see {RECIPE}"
            )
    for fact in OWN:
        said = [getattr(kind, fact) for kind in kinds]
        twice = [kind.__name__ for kind in kinds if said.count(getattr(kind, fact)) > 1]
        if twice:
            raise InputError(
                f"{' and '.join(twice)} have the same {fact}, expected one of each; see {RECIPE}"
            )
    return MappingProxyType({kind.kind: kind for kind in kinds})


KINDS: Mapping[str, type[Fault]] = table_of(Locked, FreeSwinging, Degraded)
"""The kinds of fault by the names that scenarios and logs give them."""


def kind_of(name: str) -> type[Fault]:
    """The kind of that name."""
    if name not in KINDS:
        raise unknown("kind of fault", name, "ftqp", KINDS)
    return KINDS[name]


def refuse_unknown(fault: Any) -> None:
    """Refuse what is no fault of a kind in ``KINDS``."""
    if type(fault) not in KINDS.values():
        *names, last = (f"ftqp.{kind.__name__}" for kind in KINDS.values())
        raise InputError(f"{fault!r:.200} is not a fault; expected {', '.join(names)} or {last}")


def not_served(fault: Never, who: str) -> NoReturn:
    """End a ``match`` over the kinds of fault: mypy accepts the call only where none is left."""
    refuse_unknown(fault)
    raise InputError(
        f"{who} does not serve a joint that {fault.happens} ({fault!r:.200}), expected a kind that it has a "
        f"case for, such as ftqp.Locked; write the case, see {RECIPE}"
    )
