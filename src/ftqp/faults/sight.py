"""What a monitor of servos can notice now, and how fast."""

from dataclasses import dataclass
from typing import Final, final

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray
from ftqp.kernel.layout.thresholds import LEAST_SHIFT, MOST_SHIFT

WITHIN: Final = 0.1
"""The time in which a deviation is said to be noticed [s]. A convention."""
LOOKED_AHEAD: Final = 10.0
"""A lock that is not noticed within so long [s] is said not to be noticed."""
TYPICAL: Final = 0.1
"""The speed at which a lock of a joint that rests is spoken of [rad/s or m/s]. A convention."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sight:
    """What is noticed by evidence G that gains kappa (mu z - mu^2/2) a look, mu = clip(z, 3, 8), to a level.

    Attributes:
        level: Evidence that decides.
        kappa: Share of an independent look that a look is.
        block: From one look at a joint to the next [s].
        late: How late a residual is behind the filters [s].
        deviation: Standard deviation of the residual of a joint that stands, (nv,) [rad or m].
        shaken: How much larger it is where the other joints move, by their speed, (nv,) [s].
        is_known: Of which joints the servo is known, (nv,).
        units: What a thousandth of each joint's unit is called, (nv,).

    Source: docs/theory/monitor.md, "Evidence".
    """

    level: float
    kappa: float
    block: float
    late: float
    deviation: FloatArray
    shaken: FloatArray
    is_known: BoolArray
    units: tuple[str, ...]

    def least(self, within: float = WITHIN) -> FloatArray:
        """The residual that decides within a time, (nv,) [rad or m].

        Args:
            within: For how long it is there, > 0 [s].
        """
        looks = max((within - self.late) / self.block, 1.0)
        gain = self.level / (self.kappa * looks)
        z = np.sqrt(2.0 * gain)
        if z < LEAST_SHIFT:
            z = (gain + 0.5 * LEAST_SHIFT**2) / LEAST_SHIFT
        elif z > MOST_SHIFT:
            z = (gain + 0.5 * MOST_SHIFT**2) / MOST_SHIFT
        result: FloatArray = z * self.deviation
        return result

    def lock_after(self, i: int, speed: float) -> float:
        """How long after joint i should have moved with a speed its lock is noticed [s]; inf is never.

        Args:
            i: The joint.
            speed: How fast it is asked to move [rad/s or m/s], and the others are.
        """
        t = self.block * np.arange(1, round(LOOKED_AHEAD / self.block) + 1)
        z = abs(speed) * t / np.hypot(self.deviation[i], self.shaken[i] * speed)
        shift = np.clip(z, LEAST_SHIFT, MOST_SHIFT)
        evidence = np.cumsum(np.maximum(self.kappa * (shift * z - 0.5 * shift * shift), 0.0))
        at = np.flatnonzero(evidence > self.level)
        return float(t[at[0]] + self.late) if len(at) else np.inf

    def sentence(self, i: int, joint: str, asked: float) -> str:
        """What is noticed of joint i, which is asked for a speed now [rad/s or m/s]."""
        if not self.is_known[i]:
            return (
                f"Nothing is noticed of {joint} yet, because nothing of its servo is known: let it move by a "
                "few degrees."
            )
        speed = max(abs(asked), TYPICAL)
        after = self.lock_after(i, speed)
        lock = f"about {1e3 * after:.0f} ms after" if np.isfinite(after) else "not at all when"
        rests = "; while it stands still, as now, nothing shows" if abs(asked) < 0.01 * TYPICAL else ""
        per = "rad/s" if self.units[i] == "mrad" else "m/s"
        return (
            f"{joint}: {1e3 * self.least()[i]:.2g} {self.units[i]} off what its servo explains are noticed "
            f"within {1e3 * WITHIN:.0f} ms, a lock {lock} it should move with {speed:.2g} {per}{rests}."
        )
