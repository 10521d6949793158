"""Scheme: what the arm does with its redundancy, as coefficients that add up.

At each level the objective is 1/2 x'Hx + g'x, the sum of the terms of ``ftqp.kernel.rows.objective``, each
with its coefficient of ``ftqp.Criterion``.
"""

from dataclasses import dataclass

from ftqp.core.checks import non_negative
from ftqp.core.errors import InputError
from ftqp.kernel.layout.criteria import Criterion


@dataclass(frozen=True, slots=True, kw_only=True)
class Scheme:
    """A recipe of criteria at both levels; ``a + b`` and ``2.0 * a`` mix schemes.

    Attributes:
        name: The name that tables and files use.
        acceleration: The coefficients at the acceleration level.
        velocity: The coefficients at the velocity level.
    """

    name: str
    acceleration: Criterion
    velocity: Criterion

    def at(self, level: str) -> Criterion:
        """The coefficients at a level.

        Args:
            level: ``acceleration`` or ``velocity``.

        Raises:
            InputError: The criterion is not strictly convex, so the command would not be unique.
        """
        criterion = self.acceleration if level == "acceleration" else self.velocity
        if not criterion.is_convex:
            raise InputError(
                f"scheme {self.name!r} has no weight at the {level} level; "
                "give one criterion a positive weight, or add a scheme that has one, such as mvn"
            )
        return criterion

    def __add__(self, other: "Scheme") -> "Scheme":
        return Scheme(
            name=f"{self.name} + {other.name}",
            acceleration=self.acceleration + other.acceleration,
            velocity=self.velocity + other.velocity,
        )

    def __mul__(self, weight: float) -> "Scheme":
        w = non_negative("the weight of a scheme", weight)
        return Scheme(
            name=f"{w:g} {self.name}",
            acceleration=self.acceleration.scaled(w),
            velocity=self.velocity.scaled(w),
        )

    __rmul__ = __mul__

    def named(self, name: str) -> "Scheme":
        """The same coefficients under another name.

        Args:
            name: The name that tables and files use.
        """
        return Scheme(name=name, acceleration=self.acceleration, velocity=self.velocity)
