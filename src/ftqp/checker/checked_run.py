"""What a checker says of a run: which laws were broken, where, by how much, and how well the tip followed."""

from dataclasses import dataclass
from typing import final

import numpy as np

from ftqp.checker.model_file import ModelFile
from ftqp.checker.run_laws import LAWS
from ftqp.checker.strictness import KINEMATIC, Strictness
from ftqp.checker.tip_errors import errors
from ftqp.checker.trace import Trace


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Breach:
    """A law that was broken.

    Attributes:
        law: Its name.
        tick: When it was broken first.
        joint: By which joint, or an empty text where it is a matter of the whole arm.
        size: By how much at the worst, in the unit of the law.
        ticks: At how many ticks.
    """

    law: str
    tick: int
    joint: str
    size: float
    ticks: int

    def __str__(self) -> str:
        """One sentence."""
        who = f"{self.joint}: " if self.joint else ""
        when = f"{self.law} from tick {self.tick} on, {self.ticks} ticks"
        return f"{when}: {who}{LAWS[self.law][1]}: {self.size:.3g}"


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What a checker says of a run.

    Attributes:
        breaches: The laws that were broken, none where all held.
        largest_error: Largest distance of the tip from its target [m].
        rms_error: Root mean square of that distance [m].
        largest_ok_error: Largest distance while OK was claimed [m].
    """

    breaches: tuple[Breach, ...]
    largest_error: float
    rms_error: float
    largest_ok_error: float

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
    claimed = distance[[status == "OK" for status in run.status]]
    return Verdict(
        breaches=tuple(breaches),
        largest_error=float(distance.max()),
        rms_error=float(np.sqrt(np.mean(distance**2))),
        largest_ok_error=float(claimed.max(initial=0.0)),
    )
