"""What a detector holds for likely, by joint, and the sentences in which it says so."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, final

import numpy as np

from ftqp.core.errors import unknown
from ftqp.faults.sight import Sight
from ftqp.kernel.layout.enums import FaultKind
from ftqp.kernel.layout.thresholds import COARSEST, LEAST_SPEED, SUSPECTS

WORDS = {
    FaultKind.LOCKED: "does not move",
    FaultKind.FREE_SWINGING: "has no torque",
    FaultKind.RUNAWAY: "runs away with nearly all its torque",
    FaultKind.SENSOR_FROZEN: "has an encoder that repeats its number",
    FaultKind.SENSOR_BIASED: "has an encoder whose numbers have jumped",
    FaultKind.SENSOR_DROPPED: "has an encoder that gives no numbers",
}
"""What is said of a joint by what was found of it."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """A joint that has failed.

    Attributes:
        joint: Its name.
        kinds: What it is, one word of ``kind``.
        sentence: The same for an operator.
        onset: When it began, by estimate [s] since the reset.
        detected_at: When that was certain [s] since the reset.
        withdrawn_at: When a planner saw that the joint moves after all [s] since the reset; None is never.
    """

    joint: str
    kinds: frozenset[str]
    sentence: str
    onset: float
    detected_at: float
    withdrawn_at: float | None = None

    @property
    def kind(self) -> str:
        """The kind: ``locked``, ``free_swinging``, ``runaway`` or one that begins with ``sensor_``."""
        return next(iter(self.kinds))


@final
class JointDiagnosis:
    """What is held of one joint; it follows its detector."""

    __slots__ = ("_K", "_i", "name")

    def __init__(self, name: str, index: int, K: Any) -> None:
        self.name = name
        self._i, self._K = index, K

    @property
    def z(self) -> float:
        """Its largest residual compared with the largest healthy one; above 1 it is suspicious."""
        return float(self._K.monitor.G[self._i] / self._K.monitor.level)

    @property
    def kinds(self) -> Mapping[str, float]:
        """What was found of it, with the share of verdicts that spoke for it, which is all; else nothing."""
        found = int(self._K.monitor.found[self._i])
        return {FaultKind(found).name.lower(): 1.0} if found else {}

    @property
    def onset(self) -> float | None:
        """When its failure began, by estimate [s] since the reset; None of a joint that has not failed."""
        M, i = self._K.monitor, self._i
        return float(M.began[i]) * float(self._K.state.dt) if M.found[i] else None

    @property
    def age(self) -> float | None:
        """How long ago its failure was found [s]; None of a joint that has not failed."""
        M, dt = self._K.monitor, float(self._K.state.dt)
        if not M.found[self._i]:
            return None
        return float(self._K.state.ticks) * dt - float(M.found_at[self._i]) * dt

    @property
    def speed(self) -> float:
        """Speed of its samples [rad/s or m/s]; NaN while a sample is."""
        return abs(float(self._K.monitor.v[self._i]))

    @property
    def asked(self) -> float:
        """Speed of its reference [rad/s or m/s]."""
        return abs(float(self._K.state.v_command[self._i]))

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
        K: The rooms of the detector's record.
        sight: Says what a monitor of servos can notice now, None where it has seen nothing; None of a
            detector that knows of no servos.
    """

    __slots__ = ("_K", "_joints", "_names", "_sight")

    def __init__(
        self, names: tuple[str, ...], K: Any, sight: Callable[[], Sight | None] | None = None
    ) -> None:
        self._names, self._K, self._sight = names, K, sight
        self._joints = MappingProxyType({name: JointDiagnosis(name, i, K) for i, name in enumerate(names)})

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
        """z: the largest residual over the largest healthy one; above 1 the joint is suspicious."""
        return float(self._K.monitor.worst)

    @property
    def watching(self) -> bool:
        """Whether there is a suspicion."""
        return bool(self._K.monitor.worst > SUSPECTS)

    @property
    def suspect(self) -> str | None:
        """The joint that explains the residuals best, during a suspicion."""
        i = int(self._K.monitor.suspect)
        return self._names[i] if self.watching and i >= 0 else None

    @property
    def touched(self) -> bool:
        """Whether a force at the end effector, and no joint, explains what is unusual: it is pushed."""
        return bool(self._K.feedback.touched)

    @property
    def isolated(self) -> Mapping[str, Finding]:
        """The joints that have failed."""
        codes = self._K.monitor.found[: len(self._names)]
        return {self._names[i]: self._finding(i) for i in np.flatnonzero(codes).tolist()}

    @property
    def jumped(self) -> Mapping[str, Finding]:
        """Joints that work whose encoder has jumped; by how much is taken from its numbers."""
        steps = self._K.feedback.step[: len(self._names)]
        return {self._names[i]: self._jump(i) for i in np.flatnonzero(np.abs(steps) > COARSEST).tolist()}

    @property
    def sight(self) -> Sight | None:
        """What can be noticed now and how fast, in numbers; None where that is not known."""
        return None if self._sight is None else self._sight()

    @property
    def sentences(self) -> tuple[str, ...]:
        """What the clock is to blame for, and what can be noticed of each joint now, a sentence each."""
        joints, sight = self.joints.values(), self._sight() if self._sight is not None else None
        if self._sight is None:
            texts = tuple(said for one in joints if (said := one.unobservable) is not None)
        elif sight is None:
            texts = ("Nothing can be said yet: no sample of a joint that moved was other than its command.",)
        else:
            texts = tuple(sight.sentence(i, one.name, one.asked) for i, one in enumerate(joints))
        return *self._clock(), *texts

    def _clock(self) -> tuple[str, ...]:
        """That samples came late or early, those of all joints alike, if they did."""
        off = 1e3 * abs(float(self._K.feedback.time_error))
        said = f"All samples were late or early together, by up to {off:.2g} ms: that is the clock."
        return (said,) if off > 0.0 else ()

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

    def _jump(self, i: int) -> Finding:
        """What was found of the encoder of joint i, which works on."""
        feedback, unit = self._K.feedback, "m" if self._K.chain.prismatic[i] else "rad"
        more = f" by {float(feedback.step[i]):.3g} {unit}, which is taken from them"
        at = float(feedback.step_at[i]) * float(self._K.state.dt)
        return self._found(i, FaultKind.SENSOR_BIASED, at - float(feedback.patience), at, more)

    def _finding(self, i: int) -> Finding:
        """What was found of joint i."""
        M, dt = self._K.monitor, float(self._K.state.dt)
        return self._found(i, FaultKind(int(M.found[i])), float(M.began[i]) * dt, float(M.found_at[i]) * dt)

    def _found(self, i: int, kind: FaultKind, onset: float, at: float, more: str = "") -> Finding:
        """A finding, in words."""
        name = self._names[i]
        return Finding(
            joint=name,
            kinds=frozenset({kind.name.lower()}),
            sentence=f"{name} {WORDS[kind]}{more}.",
            onset=onset,
            detected_at=at,
        )
