"""What a detector holds for likely, by joint, and the sentences in which it says so."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, final

import numpy as np

from ftqp.core.errors import unknown
from ftqp.faults.detection.sight import Sight
from ftqp.kernel.layout.enums import FaultKind
from ftqp.kernel.layout.thresholds import LEAST_SPEED

WORDS = {
    FaultKind.LOCKED: "does not move",
    FaultKind.FREE_SWINGING: "has no torque",
    FaultKind.DEGRADED: "gives less torque than asked",
    FaultKind.RUNAWAY: "runs away with nearly all its torque",
    FaultKind.SENSOR_FROZEN: "has an encoder that repeats its number",
    FaultKind.SENSOR_BIASED: "has an encoder whose numbers have jumped",
    FaultKind.SENSOR_DROPPED: "has an encoder that gives no numbers",
}
"""What is said of a joint of which one kind is left."""
SETS = {
    frozenset({"locked", "free_swinging"}): (
        "{joint} does not move: locked, or without torque and held by friction"
    ),
    frozenset({"locked", "free_swinging", "degraded"}): (
        "{joint} does not move: locked, or with too little torque, or none, to overcome its friction"
    ),
    frozenset({"locked", "degraded"}): (
        "{joint} does not move: locked, or with too little torque to overcome its friction"
    ),
    frozenset({"free_swinging", "degraded"}): (
        "{joint} gives less torque than asked; the share cannot be seen while it needs so little"
    ),
}
"""What is said where kinds cannot be told apart."""
TOUCHES = 3
"""So many ticks in a row speak for a touch. A convention, because single ones flicker."""
NO_TIP = ", or its encoder does not: no measured pose decides"
"""What is added where the encoder may be frozen, too."""


def kinds_of(code: int) -> frozenset[str]:
    """The names of the kinds in a set that compiled code wrote as a number."""
    return frozenset(kind.name.lower() for kind in FaultKind if code & kind)


def sentence_of(joint: str, kinds: frozenset[str], share: float | None) -> str:
    """What an operator reads of a finding."""
    if "sensor_frozen" in kinds and len(kinds) > 1:
        return sentence_of(joint, kinds - {"sensor_frozen"}, share).removesuffix(".") + NO_TIP + "."
    if len(kinds) > 1:
        return SETS[kinds].format(joint=joint) + "."
    kind = FaultKind[next(iter(kinds)).upper()]
    part = f"; about {100.0 * share:.0f} % is left" if share is not None else ""
    return f"{joint} {WORDS[kind]}{part}."


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """A joint that has failed.

    Attributes:
        joint: Its name.
        kinds: What it may be; more than one where they cannot be told apart.
        sentence: The same for an operator.
        onset: When it began, by estimate [s] since the reset.
        detected_at: When that was certain [s] since the reset.
        share: Part of the torque that is left, for ``degraded`` alone; None where it cannot be seen.
        size: Jump of a biased sensor [rad or m]; None of other kinds.
        withdrawn_at: When a planner saw that the joint moves after all [s] since the reset; None is never.
    """

    joint: str
    kinds: frozenset[str]
    sentence: str
    onset: float
    detected_at: float
    share: float | None = None
    size: float | None = None
    withdrawn_at: float | None = None

    @property
    def kind(self) -> str | None:
        """The kind, or None where several are left."""
        return next(iter(self.kinds)) if len(self.kinds) == 1 else None


@final
class JointDiagnosis:
    """What is held of one joint; it follows its detector."""

    __slots__ = ("_dt", "_i", "_look", "name")

    def __init__(self, name: str, index: int, look: Callable[[str], Any]) -> None:
        self.name = name
        self._i, self._look = index, look

    def _ticks(self, name: str) -> float:
        return float(self._look(name)[self._i]) * float(self._look("dt")[0])

    @property
    def z(self) -> float:
        """Its largest residual beside the largest healthy one; above 1 it is suspicious."""
        return float(self._look("z")[self._i])

    @property
    def kinds(self) -> Mapping[str, float]:
        """The kinds that may be, each with the share of the last verdicts that spoke for it."""
        found = int(self._look("kinds")[self._i])
        tally = self._look("tally")[self._i]
        if found:
            return {name: 1.0 / len(kinds_of(found)) for name in sorted(kinds_of(found))}
        if not int(self._look("watch")[0]):
            return {}
        return {
            kind.name.lower(): float(tally[bit]) for bit, kind in enumerate(FaultKind) if tally[bit] > 0.05
        }

    @property
    def onset(self) -> float | None:
        """When its failure began, by estimate [s] since the reset; None of a joint that has not failed."""
        return self._ticks("onset") if int(self._look("kinds")[self._i]) else None

    @property
    def age(self) -> float | None:
        """How long ago its failure was found [s]; None of a joint that has not failed."""
        if not int(self._look("kinds")[self._i]):
            return None
        return float(self._look("ticks")[0]) * float(self._look("dt")[0]) - self._ticks("since")

    @property
    def speed(self) -> float:
        """Mean speed of its samples over about the last 50 ticks [rad/s or m/s]; NaN while a sample is."""
        return float(self._look("speed")[self._i])

    @property
    def asked(self) -> float:
        """Mean speed of its reference over the last 50 ticks [rad/s or m/s]; 0 of one that went and came."""
        return float(self._look("asked")[self._i])

    @property
    def unobservable(self) -> str | None:
        """What cannot be seen of the joint now and what would show it, or None."""
        speed = self.asked
        if speed >= LEAST_SPEED:
            return None
        return (
            f"{self.name} is asked for {speed:.2g} rad/s: a lock, or a loss of torque without load, shows "
            f"only when it moves with {LEAST_SPEED:g} rad/s."
        )


@final
class Diagnosis:
    """What a detector holds for likely; it belongs to the detector and follows it.

    Args:
        names: The joints' names.
        look: Gives a field of the detector's record as an array.
        sight: Says what a monitor of servos can notice now, None where it has seen nothing; None of a
            detector that knows of no servos.
    """

    __slots__ = ("_joints", "_look", "_names", "_sight", "_worst")

    def __init__(
        self,
        names: tuple[str, ...],
        look: Callable[[str], Any],
        sight: Callable[[], Sight | None] | None = None,
    ) -> None:
        self._names, self._look, self._sight = names, look, sight
        self._worst = look("worst")
        self._joints = MappingProxyType({name: JointDiagnosis(name, i, look) for i, name in enumerate(names)})

    def __repr__(self) -> str:
        said = "; ".join(found.sentence for found in self.isolated.values())
        suspect = f", suspects {self.suspect}" if self.suspect else ""
        return f"Diagnosis({said or 'no joint has failed'}, suspicion {self.suspicion:.2g}{suspect})"

    @property
    def joints(self) -> Mapping[str, JointDiagnosis]:
        """What is held of each joint, by name."""
        return self._joints

    @property
    def suspicion(self) -> float:
        """z: the largest residual as a share of the largest healthy one; above 1 it is suspicious."""
        return float(self._worst[0])

    @property
    def watching(self) -> bool:
        """Whether there is a suspicion, or was one less than 0.3 s ago."""
        return bool(self._look("watch")[0] > 0)

    @property
    def suspect(self) -> str | None:
        """The joint that explains the residuals best, during a suspicion."""
        i = int(self._look("suspect")[0])
        return self._names[i] if self.watching and i >= 0 else None

    @property
    def touched(self) -> bool:
        """Whether a force at the end effector explains what is unusual, and no joint does: it is pushed."""
        return int(self._look("touched")[0]) >= TOUCHES

    @property
    def isolated(self) -> Mapping[str, Finding]:
        """The joints that have failed."""
        codes = self._look("kinds")
        return {self._names[int(i)]: self._finding(int(i)) for i in np.flatnonzero(codes[: len(self._names)])}

    @property
    def sight(self) -> Sight | None:
        """What can be noticed now and how fast, in numbers; None where that is not known."""
        return None if self._sight is None else self._sight()

    @property
    def sentences(self) -> tuple[str, ...]:
        """What can and cannot be noticed of each joint now, and how fast, a sentence each."""
        if self._sight is None:
            return tuple(said for one in self.joints.values() if (said := one.unobservable) is not None)
        sight = self._sight()
        if sight is None:
            return ("Nothing can be said yet: no sample of a joint that moved was other than its command.",)
        asked = self._look("asked")
        return tuple(sight.sentence(i, name, float(asked[i])) for i, name in enumerate(self._names))

    def of(self, joint: str) -> JointDiagnosis:
        """What is held of one joint.

        Args:
            joint: Its name.

        Raises:
            InputError: There is no such joint.
        """
        if joint not in self.joints:
            raise unknown("joint", joint, "the detector", self._names)
        return self.joints[joint]

    def _finding(self, i: int) -> Finding:
        """What was found of joint i."""
        look, dt = self._look, float(self._look("dt")[0])
        kinds, name = kinds_of(int(look("kinds")[i])), self._names[i]
        share = float(look("share")[i]) if kinds == {"degraded"} else None
        size = float(look("hop")[i]) if kinds == {"sensor_biased"} else None
        return Finding(
            joint=name,
            kinds=kinds,
            sentence=sentence_of(name, kinds, share),
            onset=float(look("onset")[i]) * dt,
            detected_at=float(look("since")[i]) * dt,
            share=share,
            size=size,
        )
