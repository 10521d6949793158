"""What gets a stalled path going again: a motion of the joints that breaks the symmetry of the posture."""

from dataclasses import dataclass

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray, positive
from ftqp.core.errors import InputError, nearest

PATTERNS = ("alternating", "single", "random")
"""Directions of an escape: the joints along +1, -1, +1, ...; one joint alone; drawn from the seed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StallEscape:
    """When a path counts as stalled, and what moves the arm on.

    An exactly symmetric posture traps every first-order method: the self-motion that it needs has no
    gradient. So the joints are drawn along a pattern without symmetry, of which the QP leaves what keeps the
    tip on its path.

    Attributes:
        below: a mean path rate below this counts as stalled [-].
        after: time constant of that mean [s].
        until: the escape ends when the mean rate exceeds this [-].
        patience: time of stalled rates, all patterns together, after which the path counts as blocked [s].
        speed: speed of the pattern [rad/s]; a prismatic joint gets it times the characteristic length [m/s].
        patterns: among ``alternating``, ``single`` and ``random``, each tried for its share of ``patience``.
        seed: of the random pattern.

    Source: closed-form spec, section 8, with 3 deg/s, 0.2, 0.1 s, 0.5 and 3 s.
    """

    below: float = 0.2
    after: float = 0.1
    until: float = 0.5
    patience: float = 3.0
    speed: float = float(np.deg2rad(3.0))
    patterns: tuple[str, ...] = PATTERNS
    seed: int = 0

    def __post_init__(self) -> None:
        for name, unit in (
            ("below", ""),
            ("after", "s"),
            ("until", ""),
            ("patience", "s"),
            ("speed", "rad/s"),
        ):
            positive(name, getattr(self, name), unit)
        if not self.below < self.until < 1.0:
            raise InputError(
                f"until is {self.until:g} and below {self.below:g}, expected rates with below < until < 1"
            )
        if not isinstance(self.patterns, tuple) or not self.patterns:
            raise InputError(f"patterns is {self.patterns!r}, expected at least one of {', '.join(PATTERNS)}")
        for name in self.patterns:
            if name not in PATTERNS:
                raise InputError(
                    f"{name!r} is not an escape pattern{nearest(str(name), PATTERNS)}; "
                    f"there are {', '.join(PATTERNS)}"
                )
        if isinstance(self.seed, bool) or not isinstance(self.seed, int) or self.seed < 0:
            raise InputError(f"seed is {self.seed!r}, expected a whole number >= 0")

    def drive(self, pattern: str, free: BoolArray) -> FloatArray:
        """The pattern's direction, (nv,), largest entry 1.

        Args:
            pattern: one of ``patterns``.
            free: which joints can move, (nv,).
        """
        n = len(free)
        if pattern == "alternating":
            alternating: FloatArray = np.where(np.arange(n) % 2 == 0, 1.0, -1.0)
            return alternating
        if pattern == "single":
            one: FloatArray = np.zeros(n)
            one[int(np.argmax(free))] = 1.0
            return one
        drawn = np.random.default_rng(self.seed).uniform(-1.0, 1.0, n)
        direction: FloatArray = drawn / np.abs(drawn).max()
        return direction
