"""The laws that a run is held against, and what is said of it: which broke, where, by how much."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from ftqp.checker.boundary_laws import cone, plane, touched
from ftqp.checker.claim_laws import errors, honesty, inside, obedience, tasks, tracking
from ftqp.checker.model_file import ModelFile
from ftqp.checker.motion_laws import acceleration, braking, chatter, failed, held, position, rest, speed
from ftqp.checker.recovery_law import recovery
from ftqp.checker.torque_law import torque
from ftqp.checker.trace import KINEMATIC, Strictness, Trace
from ftqp.core.checks import FloatArray


def finite(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """Infinite where a position or velocity, true or sent, is not finite, (K, nv)."""
    good = np.isfinite(run.sent_q) & np.isfinite(run.sent_v) & np.isfinite(run.q[1:]) & np.isfinite(run.v[1:])
    return np.where(good, 0.0, np.inf)


Law = Callable[[ModelFile, Trace, Strictness], Any]
LAWS: dict[str, tuple[Law, str]] = {
    "finite": (finite, "what was sent or done is not a number"),
    "speed": (speed, "faster than its limit, by this share"),
    "acceleration": (acceleration, "accelerated more than its limit, by this share"),
    "position": (position, "beyond the end of its range, by this [rad or m]"),
    "braking": (braking, "cannot brake any more before the end of its range, by this [rad or m]"),
    "plane": (plane, "a point that it moves is beyond its plane, by this [m]"),
    "cone": (cone, "an axis that it moves is outside its cone, by this [rad]"),
    "touched": (touched, "a body that it moves is nearer to another than it may be, by this [m]"),
    "torque": (torque, "carries more than its limit without need, by this share"),
    "failed": (failed, "is locked and has moved, or was sent to move, by this in all [rad or m]"),
    "honesty": (
        honesty,
        "OK was claimed although the end effector is farther than the tolerance, by this share",
    ),
    "tasks": (
        tasks,
        "OK was claimed although a further task that counts is farther than the tolerance, by this share",
    ),
    "tracking": (tracking, "the target can be followed and was not, by this share of the tolerance"),
    "recovery": (
        recovery,
        "the joints left can do the rest of the task and did not, by this share of the tolerance or path",
    ),
    "inside": (inside, "OK was claimed although a joint is outside its range, by this [rad or m]"),
    "obedience": (obedience, "OK was claimed although a joint is not where it was sent, by this [rad or m]"),
    "chatter": (chatter, "jolts at full acceleration, so many times in a row more than a correction does"),
    "held": (held, "was held with all others and leaps, by this share, or is blamed for it"),
    "rest": (rest, "the target rests and the joint swings, at this share of its speed limit"),
}
"""Laws by name: how much each is broken by, at which tick and joint, and what to say of it."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Breach:
    """A law that was broken."""

    law: str  # Its name
    tick: int  # When it was broken first
    joint: str  # By which joint, or an empty text where it is a matter of the whole arm
    size: float  # By how much at the worst, in the unit of the law
    ticks: int  # At how many ticks

    def __str__(self) -> str:
        """One sentence."""
        who = f"{self.joint}: " if self.joint else ""
        when = f"{self.law} from tick {self.tick} on, {self.ticks} ticks"
        return f"{when}: {who}{LAWS[self.law][1]}: {self.size:.3g}"


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What a checker says of a run."""

    breaches: tuple[Breach, ...]  # The laws that were broken, none where all held
    largest_error: float  # Largest distance of the tip from its target [m]
    rms_error: float  # Root mean square of that distance [m]
    largest_ok_error: float  # Largest distance while OK was claimed [m]

    @property
    def laws(self) -> frozenset[str]:
        """Names of the laws that were broken."""
        return frozenset(breach.law for breach in self.breaches)


def verdict(arm: ModelFile, run: Trace, strict: Strictness = KINEMATIC) -> Verdict:
    """Hold a run against every law."""
    breaches = []
    with np.errstate(invalid="ignore", over="ignore"):
        for name, (law, _) in LAWS.items():
            over = np.asarray(law(arm, run, strict), dtype=np.float64)
            broken = ~(over <= 0.0)
            if broken.any():
                ticks = np.flatnonzero(broken.any(axis=1))
                worst = np.where(broken, np.nan_to_num(over, nan=np.inf), -np.inf)
                joint = int(np.unravel_index(int(worst.argmax()), worst.shape)[1])
                breaches.append(
                    Breach(
                        law=name,
                        tick=int(ticks[0]),
                        joint=arm.names[joint] if over.shape[1] > 1 else "",
                        size=float(worst.max()),
                        ticks=len(ticks),
                    )
                )
            if name == "finite" and broken.any():
                return Verdict(
                    breaches=tuple(breaches), largest_error=np.inf, rms_error=np.inf, largest_ok_error=np.inf
                )
        distance, _ = errors(arm, run)
    claimed = distance[run.claims_ok]
    return Verdict(
        breaches=tuple(breaches),
        largest_error=float(distance.max()),
        rms_error=float(np.sqrt(np.mean(distance**2))),
        largest_ok_error=float(claimed.max(initial=0.0)),
    )
