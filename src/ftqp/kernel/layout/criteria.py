"""The coefficients of the objective: what a criterion is to the record, one field a coefficient."""

from dataclasses import dataclass, fields


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
    """

    norm: float = 0.0
    norm_v: float = 0.0
    norm_q: float = 0.0
    inertia: float = 0.0
    inertia_v: float = 0.0
    inertia_h: float = 0.0
    torque: float = 0.0
    manipulability: float = 0.0

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
        return self.inertia != 0.0 or self.torque != 0.0


COEFFICIENTS = tuple(f.name for f in fields(Criterion))
"""Their names, the fields of the record's room."""
