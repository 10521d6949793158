"""Laws of motion: how the way along a path, s from 0 to 1, depends on the normalised time u from 0 to 1."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, final

import numpy as np

from ftqp.core.checks import FloatArray, positive
from ftqp.core.errors import InputError, unknown
from ftqp.core.setting import Setting, made_from

LAW = Setting(
    "law of motion: quintic, cycloid, sine_squared, constant, trapezoid, or a table such as { name, ramp }",
    of=dict[str, Any],
    short="name",
)


class LawSample(NamedTuple):
    """A law and its derivatives with respect to u, each of the shape of u.

    Attributes:
        s: The share of the way that is done, 0 to 1.
        ds: The first derivative ds/du, without unit.
        dds: The second derivative d2s/du2, without unit.
    """

    s: FloatArray
    ds: FloatArray
    dds: FloatArray


class Law(ABC):
    """The role of a law of motion; it rises from s(0) = 0 to s(1) = 1 without turning back."""

    name: str

    @final
    def sample(self, u: FloatArray) -> LawSample:
        """s, ds/du and d2s/du2 at ``u``, continued at rest outside [0, 1).

        The sample is what holds from ``u`` on: a law that ends with a jump of speed is at rest at u = 1.
        """
        inside = np.clip(u, 0.0, 1.0)
        moving = (u >= 0.0) & (u < 1.0)
        s, ds, dds = self._formula(inside)
        s = np.where(u >= 1.0, 1.0, np.where(u <= 0.0, 0.0, s))
        return LawSample(s, np.where(moving, ds, 0.0), np.where(moving, dds, 0.0))

    @abstractmethod
    def _formula(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """s, s' and s'' for u within [0, 1]."""


@final
class Quintic(Law):
    """s = 10 u^3 - 15 u^4 + 6 u^5: starts and ends with zero speed and zero acceleration."""

    name = "quintic"

    def _formula(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        rest = 1.0 - u
        return (
            u**3 * (10.0 + u * (6.0 * u - 15.0)),
            30.0 * (u * rest) ** 2,
            60.0 * u * rest * (1.0 - 2.0 * u),
        )


@final
class Cycloid(Law):
    """s = u - sin(2 pi u) / (2 pi): zero speed and acceleration at both ends, jumps only in the jerk."""

    name = "cycloid"

    def _formula(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        phase = 2.0 * np.pi * u
        return u - np.sin(phase) / (2.0 * np.pi), 1.0 - np.cos(phase), 2.0 * np.pi * np.sin(phase)


@final
class SineSquared(Law):
    """s = sin^2(pi u / 2): zero speed at both ends, acceleration jumps there."""

    name = "sine_squared"

    def _formula(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        phase = np.pi * u
        return np.sin(0.5 * phase) ** 2, 0.5 * np.pi * np.sin(phase), 0.5 * np.pi**2 * np.cos(phase)


@final
class Constant(Law):
    """s = u: constant speed; the speed jumps at both ends, so expect a tracking error there."""

    name = "constant"

    def _formula(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        return u.copy(), np.ones_like(u), np.zeros_like(u)


@final
class Trapezoid(Law):
    """Speed rises linearly for the fraction ``ramp`` of the time, is constant, and falls for as long.

    With r = ramp and the top speed c = 1 / (1 - r): s = c u^2 / (2 r) for u <= r, c (u - r/2) between, and 1
    - c (1 - u)^2 / (2 r) for u >= 1 - r.

    Args:
        ramp: Fraction of the duration that speeding up takes, and again slowing down, in (0, 0.5], without
            unit. A larger one has smaller accelerations and a higher top speed.
    """

    name = "trapezoid"

    def __init__(self, ramp: float = 0.25) -> None:
        self.ramp = positive("ramp of the trapezoid law", ramp)
        if self.ramp > 0.5:
            raise InputError(f"ramp of the trapezoid law is {self.ramp:g}, expected a fraction in (0, 0.5]")

    def _formula(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        r, c = self.ramp, 1.0 / (1.0 - self.ramp)
        rising, falling = u < r, u >= 1.0 - r
        s = np.where(rising, c * u**2 / (2.0 * r), c * (u - 0.5 * r))
        s = np.where(falling, 1.0 - c * (1.0 - u) ** 2 / (2.0 * r), s)
        ds = np.where(rising, c * u / r, np.where(falling, c * (1.0 - u) / r, c))
        dds = np.where(rising, c / r, np.where(falling, -c / r, 0.0))
        return s, ds, dds


_LAWS: Mapping[str, Callable[[], Law]] = {
    law.name: law for law in (Quintic, Cycloid, SineSquared, Constant, Trapezoid)
}


def names() -> tuple[str, ...]:
    """The names that `by_name` knows."""
    return tuple(_LAWS)


def by_name(law: str | Mapping[str, Any] | Law) -> Law:
    """The law for a name, for a table such as ``{"name": "trapezoid", "ramp": 0.1}``, or a law itself."""
    if isinstance(law, Law):
        return law
    table: Mapping[str, Any] = {"name": law} if isinstance(law, str) else law
    name = table.get("name") if isinstance(table, Mapping) else table
    if not isinstance(name, str) or name not in _LAWS:
        raise unknown("law of motion", name, "ftqp", _LAWS)
    parameters = {key: value for key, value in table.items() if key != "name"}
    return made_from(_LAWS[name], parameters, f"the law {name!r}")
