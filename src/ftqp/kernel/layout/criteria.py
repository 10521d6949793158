"""The coefficients of the objective: what a criterion is to the record, one field a coefficient.

Where one that does not declare H to be steady is not zero, external solvers are handed H anew at every tick.
"""

from dataclasses import dataclass, field, fields
from typing import Any

from ftqp.core.checks import is_number, non_negative, shown
from ftqp.core.errors import InputError


def _coefficient(*, weight: bool = False, inertia: bool = False, steady: bool = False) -> Any:
    """A field of a criterion."""
    return field(default=0.0, metadata={"weight": weight, "inertia": inertia, "steady": steady})


@dataclass(frozen=True, slots=True, kw_only=True)
class Criterion:
    """The coefficients at one level, x being the acceleration or the velocity; larger ones weigh more.

    Attributes:
        norm: Weight of |x|^2/2, >= 0, without unit.
        norm_v: Factor of x'v [1/s at the acceleration level].
        norm_q: Factor of x'(q - posture) [1/s2 at the acceleration level, 1/s at the velocity level].
        inertia: Weight of x'M x/2, >= 0, without unit.
        inertia_v: Factor of x'M v [1/s at the acceleration level].
        inertia_h: Factor of x'h, without unit.
        torque: Weight of |tau|^2/2 of the joints that have not failed, >= 0, without unit.
        manipulability: Factor of -x' d/dq log sqrt det(J J'), >= 0 [rad2/s at the velocity level].

    Raises:
        InputError: A coefficient is not finite, or one that weighs a quadratic form is negative.
    """

    norm: float = _coefficient(weight=True, steady=True)
    norm_v: float = _coefficient(steady=True)
    norm_q: float = _coefficient(steady=True)
    inertia: float = _coefficient(weight=True, inertia=True)
    inertia_v: float = _coefficient(inertia=True, steady=True)
    inertia_h: float = _coefficient(inertia=True, steady=True)
    torque: float = _coefficient(weight=True, inertia=True)
    manipulability: float = _coefficient(steady=True)

    def __post_init__(self) -> None:
        for one in fields(self):
            value = getattr(self, one.name)
            if one.metadata["weight"]:
                non_negative(f"{one.name} of a criterion", value)
            elif not is_number(value):
                raise InputError(f"{one.name} of a criterion is {shown(value)}, expected a finite number")

    def __add__(self, other: "Criterion") -> "Criterion":
        return Criterion(**{f.name: getattr(self, f.name) + getattr(other, f.name) for f in fields(self)})

    def scaled(self, weight: float) -> "Criterion":
        """The criterion times a weight.

        Args:
            weight: The factor of every coefficient, >= 0.
        """
        return Criterion(**{f.name: weight * getattr(self, f.name) for f in fields(self)})

    @property
    def needs_inertia(self) -> bool:
        """Whether M and h are needed every tick."""
        return any(getattr(self, f.name) != 0.0 for f in fields(self) if f.metadata["inertia"])

    @property
    def is_convex(self) -> bool:
        """Whether a quadratic form has a positive weight, so that the command is unique."""
        return any(getattr(self, f.name) > 0.0 for f in fields(self) if f.metadata["weight"])

    @property
    def has_constant_hessian(self) -> bool:
        """Whether H is ``norm`` times the joint weights at every tick, so that a solver may keep it."""
        return all(getattr(self, f.name) == 0.0 for f in fields(self) if not f.metadata["steady"])


COEFFICIENTS = tuple(f.name for f in fields(Criterion))
"""Their names, the fields of the record's room."""
