"""What is measured of the joints: late, in steps, biased, noisy, and at times plainly wrong."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import isfinite
from types import MappingProxyType
from typing import Any, ClassVar, final

import numpy as np

from ftqp.core.checks import FloatArray, array, non_negative, positive
from ftqp.core.errors import InputError
from ftqp.core.setting import Setting, Settings, keys_of, setting
from ftqp.model.robot import Robot
from ftqp.sim.plants.plant import Motors
from ftqp.sim.schedule import first_tick


@dataclass(frozen=True, slots=True)
class Reading:
    """What is about to be measured; q and v, each (nv,), are to be changed in place."""

    q: FloatArray  # positions [rad or m]
    v: FloatArray  # velocities [rad/s or m/s]
    last_q: FloatArray  # positions of the sample before
    last_v: FloatArray  # velocities of the sample before
    number: int  # of the sample since the fault began, from 0
    dt: float  # sampling period [s]
    generator: np.random.Generator  # of everything random


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorFault(ABC):
    """What an encoder does wrong from ``at`` on.

    Args:
        joint: The joint's name or its 0-based index; None is every joint.
        at: When it begins, >= 0 [s].
        samples: How many samples in a row are wrong, >= 1; None is all from then on.
        duration: For how long they are wrong, in place of a number of samples, > 0 [s].
    """

    kind: ClassVar[str]

    joint: str | int | None = setting(None, least=0.0)
    at: float = setting(0.0, unit="s", least=0.0, needed=True)
    samples: int | None = setting(None, least=1.0)
    duration: float | None = setting(None, unit="s", above=0.0)

    def __post_init__(self) -> None:
        non_negative("time of the sensor's fault", self.at, "s")
        if self.samples is not None and (type(self.samples) is not int or self.samples < 1):
            raise InputError(f"samples is {self.samples!r}, expected a whole number >= 1, or None for ever")
        if self.duration is not None:
            positive("duration of the sensor's fault", self.duration, "s")
            if self.samples is not None:
                raise InputError("samples and duration both say how long a sensor is wrong; leave one out")
        for name, key in keys_of(type(self)).items():
            value = getattr(self, name)
            if key.hint is float and not isfinite(value):
                raise InputError(f"{name} is {value!r}, expected a finite number")

    def ticks(self, dt: float) -> int | None:
        """How many samples in a row are wrong; None is all from then on."""
        return self.samples if self.duration is None else max(1, round(self.duration / dt))

    @abstractmethod
    def spoil(self, reading: Reading, joints: slice) -> None:
        """Change the reading of ``joints``, which is without this fault."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Frozen(SensorFault):
    """The encoder repeats its last reading."""

    kind: ClassVar[str] = "frozen"

    def spoil(self, reading: Reading, joints: slice) -> None:
        reading.q[joints], reading.v[joints] = reading.last_q[joints], reading.last_v[joints]


@dataclass(frozen=True, slots=True, kw_only=True)
class Dropped(SensorFault):
    """The encoder says nothing: the reading is NaN."""

    kind: ClassVar[str] = "dropped"

    def spoil(self, reading: Reading, joints: slice) -> None:
        reading.q[joints] = reading.v[joints] = np.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class Offset(SensorFault):
    """The reading is off by a constant: a spike with few samples, a bias with many.

    Args:
        size: Added to the position [rad or m]; 2 pi is a wrapped angle.
        speed: Added to the velocity [rad/s or m/s].
    """

    kind: ClassVar[str] = "offset"

    size: float = setting(0.0, unit="rad or m")
    speed: float = setting(0.0, unit="rad/s or m/s")

    def spoil(self, reading: Reading, joints: slice) -> None:
        reading.q[joints] += self.size
        reading.v[joints] += self.speed


@dataclass(frozen=True, slots=True, kw_only=True)
class Drifting(SensorFault):
    """The reading runs away from the truth.

    Args:
        rate: How fast the reading runs away [rad/s or m/s].
    """

    kind: ClassVar[str] = "drifting"

    rate: float = setting(0.0, unit="rad/s or m/s")

    def spoil(self, reading: Reading, joints: slice) -> None:
        reading.q[joints] += self.rate * (reading.number + 1) * reading.dt
        reading.v[joints] += self.rate


@dataclass(frozen=True, slots=True, kw_only=True)
class Scattered(SensorFault):
    """Some readings, chosen at random, are off by a random amount.

    Args:
        share: Share of wrong samples, 0 to 1.
        size: Standard deviation of the wrong ones, >= 0 [rad or m].
    """

    kind: ClassVar[str] = "scattered"

    share: float = setting(0.05, least=0.0, most=1.0)
    size: float = setting(0.5, unit="rad or m", least=0.0)

    def __post_init__(self) -> None:
        SensorFault.__post_init__(self)
        non_negative("size", self.size, "rad")
        if not 0.0 <= self.share <= 1.0:
            raise InputError(f"share is {self.share!r}, expected a share of the samples in [0, 1]")

    def spoil(self, reading: Reading, joints: slice) -> None:
        count = len(reading.q[joints])
        wrong = reading.generator.random(count) < self.share
        reading.q[joints] += np.where(wrong, self.size * reading.generator.standard_normal(count), 0.0)


SENSOR_KINDS: Mapping[str, type[Any]] = MappingProxyType(
    {kind.kind: kind for kind in (Frozen, Dropped, Offset, Drifting, Scattered)}
)
"""The kinds of sensor fault by the names that scenarios give them."""


LATEST = 100_000
"""Samples come no later than by so many ticks; all on their way are kept."""


@final
class JointSensors:
    """Encoders between the true arm and its planner.

    In this order: the truth of ``latency`` ticks ago, rounded to whole ``quantum``, plus ``bias``, plus white
    noise, and then what faults make of it. Without any of them the truth is handed on bit by bit.

    Args:
        robot: whose joints are measured.
        dt: sampling period [s].
        latency: ticks of delay, >= 0; until so many are over the first sample is repeated.
        quantum: smallest step of a position, >= 0 [rad or m]; 0 is none. Velocities are not rounded.
        bias: constant error of every position, one number or (nv,) [rad or m].
        position_noise: standard deviation of every position, >= 0 [rad or m].
        velocity_noise: standard deviation of every velocity, >= 0 [rad/s or m/s].
        torque_noise: standard deviation of motors' torques, >= 0 [N m or N]; None: they are not measured.
        faults: what goes wrong, applied in the order given.
        seed: of everything random.

    Attributes:
        q: what was measured last, (nv,) [rad or m]; belongs to the sensors.
        v: the velocities of that measurement, (nv,) [rad/s or m/s]; belongs to the sensors.
        tau: the torques of the motors of that measurement, (nv,) [N m or N]; None where none are measured.
        demand: the torques that the drives asked of them when it was taken, (nv,); None where none are known.

    Raises:
        InputError: a value out of its range, or an unknown joint.
    """

    settings: ClassVar[Settings] = {
        "latency": Setting(least=0.0),
        "quantum": Setting(unit="rad or m", least=0.0),
        "bias": Setting(unit="rad or m", of=float | tuple[float, ...]),
        "position_noise": Setting(unit="rad or m", least=0.0),
        "velocity_noise": Setting(unit="rad/s or m/s", least=0.0),
        "torque_noise": Setting(unit="N m or N", least=0.0),
        "faults": Setting(of=tuple[SensorFault, ...], kinds=SENSOR_KINDS),
    }

    def __init__(
        self,
        robot: Robot,
        dt: float,
        *,
        latency: int = 0,
        quantum: float = 0.0,
        bias: Any = 0.0,
        position_noise: float = 0.0,
        velocity_noise: float = 0.0,
        torque_noise: float | None = None,
        faults: Iterable[SensorFault] = (),
        seed: int = 0,
    ) -> None:
        if type(latency) is not int or not 0 <= latency <= LATEST:
            raise InputError(
                f"latency of the sensors is {latency!r:.40}, expected a whole number of ticks, 0 to {LATEST}"
            )
        n = robot.nv
        self._dt, self._latency, self._seed = dt, latency, seed
        self._quantum = non_negative("quantum of the sensors", quantum, "rad")
        self._bias = array("bias of the sensors", np.full(n, bias) if np.ndim(bias) == 0 else bias, (n,))
        self._noise_q = non_negative("position noise", position_noise, "rad")
        self._noise_v = non_negative("velocity noise", velocity_noise, "rad/s")
        self._noise_tau = None if torque_noise is None else non_negative("torque noise", torque_noise, "N m")
        self._faults = [
            (_joints(fault, robot), first_tick(fault.at, dt), fault.ticks(dt), fault) for fault in faults
        ]
        self._ring, self._motors = np.zeros((latency + 1, 2, n)), np.zeros((latency + 1, 2, n))
        self._last = np.zeros((2, n))
        self.q, self.v = np.zeros(n), np.zeros(n)
        self.tau: FloatArray | None = None
        self.demand: FloatArray | None = None
        self.reset()

    @property
    def feels_torque(self) -> bool:
        """Whether torques are measured."""
        return self._noise_tau is not None

    def reset(self) -> None:
        """Forget what has been measured; the same noise comes again."""
        self._samples = 0
        self._generator = np.random.default_rng(self._seed)

    def measure(self, q: FloatArray, v: FloatArray, motors: Motors | None = None) -> None:
        """Take the next sample of the true state into ``q`` and ``v`` of the sensors.

        Args:
            q: True joint positions, (nv,) [rad or m].
            v: True joint velocities, (nv,) [rad/s or m/s].
            motors: What the motors do; None of an arm that has none.
        """
        k, ring = self._samples, self._ring
        if k == 0:
            ring[:, 0], ring[:, 1] = q, v
            self.q[:], self.v[:] = q, v
        self._last[0], self._last[1] = self.q, self.v
        ring[k % len(ring), 0], ring[k % len(ring), 1] = q, v
        seen = ring[(k - self._latency) % len(ring)]
        self.q[:], self.v[:] = seen[0], seen[1]
        if self._quantum > 0.0:
            self.q[:] = self._quantum * np.round(self.q / self._quantum)
        if self._bias.any():
            self.q += self._bias
        if self._noise_q > 0.0:
            self.q += self._noise_q * self._generator.standard_normal(len(self.q))
        if self._noise_v > 0.0:
            self.v += self._noise_v * self._generator.standard_normal(len(self.v))
        for joints, first, ticks, fault in self._faults:
            number = k - first
            if number >= 0 and (ticks is None or number < ticks):
                last_q, last_v = self._last
                reading = Reading(self.q, self.v, last_q, last_v, number, self._dt, self._generator)
                fault.spoil(reading, joints)
        if motors is not None:
            self._feel(k, motors)
        self._samples = k + 1

    def _feel(self, k: int, motors: Motors) -> None:
        """The torques of the sample, as late as the positions."""
        ring = self._motors
        if k == 0:
            ring[:, 0], ring[:, 1] = motors
        ring[k % len(ring), 0], ring[k % len(ring), 1] = motors
        tau, demand = ring[(k - self._latency) % len(ring)]
        self.demand = demand.copy()
        if self._noise_tau is not None:
            self.tau = tau + self._noise_tau * self._generator.standard_normal(len(tau))


def _joints(fault: SensorFault, robot: Robot) -> slice:
    """Whose reading the fault changes."""
    if fault.joint is None:
        return slice(0, robot.nv)
    i = robot.joint(fault.joint)
    return slice(i, i + 1)
