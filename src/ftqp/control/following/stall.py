"""What gets a stalled path going again: a motion of the joints that breaks the symmetry of the posture."""

from dataclasses import dataclass

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray
from ftqp.core.errors import InputError, nearest
from ftqp.core.setting import refuse_out_of_range, setting

PATTERNS = ("alternating", "single", "random")
"""Directions of an escape: the joints along +1, -1, +1, ...; one joint alone; drawn from the seed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StallEscape:
    """When a path counts as stalled, and what moves the arm on.

    A posture that is exactly symmetric, such as a stretched arm, traps every first-order method: the
    self-motion that it needs has no gradient. The joints are therefore drawn along a pattern without
    symmetry, of which the QP leaves what keeps the end effector on its path. Without an escape such an arm
    waits for ever (``docs/theory/path-progress.md``); the least error of the start, and so the noise of a
    real arm, frees it as well. When no pattern helps, the path is called blocked, which nothing else does.

    Attributes:
        below: A mean path rate below this counts as stalled, in (0, until), without unit. A larger one begins
            to escape where the path is only slow.
        after: Time constant of that mean, > 0 [s]. A larger one waits longer before it escapes.
        until: The escape ends when the mean rate exceeds this, in (below, 1), without unit. A larger one
            keeps the joints moving for longer.
        patience: How long a path may be stalled, all patterns together, before it counts as blocked, > 0 [s].
            A shorter one gives the verdict sooner and gives up paths that would have gone on slowly.
        standing: The same for a path that does not go on at all, its mean rate below 1 %, and past whose
            singularity no self-motion leads, > 0 [s]. A longer one gives the patterns more time. It needs
            ``Task(calm=True)``: without it the arm oscillates instead of standing.
        speed: Speed of the pattern, > 0 [rad/s]; a prismatic joint gets it times the characteristic length
            [m/s]. A larger one leaves the trap sooner with more motion of the joints.
        patterns: Names among ``alternating``, ``single`` and ``random``, each tried for its share of
            ``patience``.
        seed: The seed of the random pattern, >= 0; the same seed gives the same pattern.

    Source: ``docs/theory/path-progress.md``.
    """

    below: float = setting(0.2, above=0.0, below=1.0)
    after: float = setting(0.1, unit="s", above=0.0)
    until: float = setting(0.5, above=0.0, below=1.0)
    patience: float = setting(3.0, unit="s", above=0.0)
    standing: float = setting(0.6, unit="s", above=0.0)
    speed: float = setting(float(np.deg2rad(3.0)), unit="rad/s", above=0.0)
    patterns: tuple[str, ...] = setting(PATTERNS, count=(1, None))
    seed: int = setting(0, least=0.0)

    def __post_init__(self) -> None:
        refuse_out_of_range(self)
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

    def drive(self, pattern: str, free: BoolArray) -> FloatArray:
        """The pattern's direction, (nv,), largest entry 1.

        Args:
            pattern: One of ``patterns``.
            free: Which joints can move, (nv,).
        """
        n = len(free)
        drawn = np.random.default_rng(self.seed).uniform(-1.0, 1.0, n)
        if pattern == "alternating":
            drawn = np.where(np.arange(n) % 2 == 0, 1.0, -1.0)
        elif pattern == "single":
            drawn = np.where(np.arange(n) == np.argmax(free), 1.0, 0.0)
        direction: FloatArray = drawn / np.abs(drawn).max()
        return direction
