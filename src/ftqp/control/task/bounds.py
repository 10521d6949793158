"""How joint limits become one interval a joint: the conversions that a planner can be made with."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar

from ftqp.core.checks import non_negative, positive
from ftqp.core.errors import InputError, nearest
from ftqp.kernel.layout import enums as codes


@dataclass(frozen=True, slots=True)
class Viability:
    """The default: after every command the joint can still brake before its limits.

    The interval is never empty. Velocity level: exact discrete braking. Source: Del Prete 2018; spec of the
    different-level scheme, 6.1 and 6.4.
    """

    name: ClassVar[str] = "viability"
    code: ClassVar[int] = codes.VIABILITY


@dataclass(frozen=True, slots=True)
class Jin:
    """The conversion of Jin et al. 2017, for its experiments: may come out empty and may overrun a limit.

    Args:
        gamma_p: gain on the distance to the tightened position limit [1/s2].
        gamma_v: gain on the distance to the velocity limit [1/s].
        margin: tightening of the position limits [rad or m].
        upsilon: gain on the distance to the position limit at the velocity level [1/s].
    """

    gamma_p: float = 20.0
    gamma_v: float = 20.0
    margin: float = 0.1
    upsilon: float = 4.0
    name: ClassVar[str] = "jin"
    code: ClassVar[int] = codes.JIN

    def __post_init__(self) -> None:
        for key in ("gamma_p", "gamma_v", "upsilon"):
            positive(key, getattr(self, key))
        non_negative("margin", self.margin, "rad")


@dataclass(frozen=True, slots=True)
class OneStep:
    """Looks one step ahead only, for comparison: overruns position limits.

    Source: Flacco, De Luca, Khatib 2012.
    """

    name: ClassVar[str] = "one_step"
    code: ClassVar[int] = codes.ONE_STEP


Bounds = Viability | Jin | OneStep
_KINDS: dict[str, type[Viability] | type[Jin] | type[OneStep]] = {
    k.name: k for k in (Viability, Jin, OneStep)
}


def names() -> tuple[str, ...]:
    """The names that ``by_name`` knows."""
    return tuple(_KINDS)


def by_name(given: "str | Mapping[str, Any] | Bounds") -> Bounds:
    """A conversion from its name, from ``{"name": "jin", "gamma_p": 20.0}``, or as it is.

    Raises:
        InputError: unknown name or parameter.
    """
    if isinstance(given, Viability | Jin | OneStep):
        return given
    arguments = dict(given) if isinstance(given, Mapping) else {"name": given}
    name = arguments.pop("name", None)
    if name not in _KINDS:
        raise InputError(
            f"{name!r} is not a bound conversion{nearest(str(name), _KINDS)}; there are {', '.join(_KINDS)}"
        )
    kind = _KINDS[name]
    known = [f.name for f in fields(kind)]
    for key in arguments:
        if key not in known:
            raise InputError(
                f"{key!r} is not a parameter of bounds {name!r}{nearest(key, known)}; "
                f"it has {', '.join(known) or 'none'}"
            )
    return kind(**arguments)
