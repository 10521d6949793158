"""How joint limits become one interval a joint, by name; derived in ``docs/theory/joint-limits.md``."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from ftqp.core.errors import InputError, nearest
from ftqp.core.setting import made_from, refuse_out_of_range, setting
from ftqp.kernel.layout.enums import Conversion


@dataclass(frozen=True, slots=True)
class Viability:
    """After every command the joint can still brake before its limits; this is the default.

    The interval is never empty, and every limit holds between the ticks too. The speed towards a limit is
    that of exact braking in whole ticks, so that a joint which is pressed against its limit rests there.

    Source: Del Prete 2018, derived anew in ``docs/theory/joint-limits.md``.
    """

    name: ClassVar[str] = "viability"
    code: ClassVar[int] = Conversion.VIABILITY


@dataclass(frozen=True, slots=True)
class Jin:
    """The conversion of Jin et al. 2017, for its experiments; it may come out empty and may overrun a limit.

    Args:
        gamma_p: Gain on the distance to the tightened position limit, > 0 [1/s2]. Positions hold only for
            (v_max/margin)^2 <= gamma_p <= a_max/margin; a larger gain brakes later and harder.
        gamma_v: Gain on the distance to the velocity limit, > 0 [1/s]. Velocities hold only up to 1/dt; a
            larger gain lets the speed come nearer to its limit.
        margin: How much the position limits are tightened, >= 0 [rad or m]. A larger margin leaves less of
            the range and stops more surely.
        upsilon: Gain on the distance to the position limit at the velocity level, > 0 and at most 1/dt [1/s].
            A larger gain lets the joint come faster towards its limit.

    Source: Jin et al. 2017; the position and velocity terms are a reconstruction, see
    ``docs/theory/joint-limits.md``.
    """

    gamma_p: float = setting(20.0, unit="1/s2", above=0.0)
    gamma_v: float = setting(20.0, unit="1/s", above=0.0)
    margin: float = setting(0.1, unit="rad", least=0.0)
    upsilon: float = setting(4.0, unit="1/s", above=0.0)
    name: ClassVar[str] = "jin"
    code: ClassVar[int] = Conversion.JIN

    def __post_init__(self) -> None:
        refuse_out_of_range(self)


@dataclass(frozen=True, slots=True)
class OneStep:
    """The conversion that looks one tick ahead only; it overruns position limits and is there for comparison.

    Source: Flacco et al. 2012, whose method is this interval for each joint.
    """

    name: ClassVar[str] = "one_step"
    code: ClassVar[int] = Conversion.ONE_STEP


Bounds = Viability | Jin | OneStep
_KINDS: dict[str, Callable[..., Bounds]] = {kind.name: kind for kind in (Viability, Jin, OneStep)}


def names() -> tuple[str, ...]:
    """The names that ``by_name`` knows."""
    return tuple(_KINDS)


def by_name(given: "str | Mapping[str, Any] | Bounds") -> Bounds:
    """A conversion from its name, from ``{"name": "jin", "gamma_p": 20.0}``, or as it is.

    Args:
        given: A name of ``names()``, a mapping with a name and parameters, or a conversion.

    Raises:
        InputError: The name or a parameter is unknown.
    """
    if isinstance(given, Viability | Jin | OneStep):
        return given
    arguments = dict(given) if isinstance(given, Mapping) else {"name": given}
    name = arguments.pop("name", None)
    if name not in _KINDS:
        raise InputError(
            f"{name!r} is not a bound conversion{nearest(str(name), _KINDS)}; there are {', '.join(_KINDS)}"
        )
    return made_from(_KINDS[name], arguments, f"bounds {name!r}")
