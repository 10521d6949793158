"""What goes wrong with an encoder: this file is the one list of kinds, with what a scenario may say of each.

A kind has its name in files (``kind``) and changes the reading of one joint, or of all, from its time on for
so many samples.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from ftqp.core.checks import FloatArray, non_negative
from ftqp.core.errors import InputError
from ftqp.core.setting import keys_of, setting


@dataclass(frozen=True, slots=True)
class Reading:
    """What is about to be measured; each (nv,), to be changed in place."""

    q: FloatArray  # positions [rad or m]
    v: FloatArray  # velocities [rad/s or m/s]
    last_q: FloatArray  # positions of the sample before
    last_v: FloatArray  # velocities of the sample before


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorFault(ABC):
    """What an encoder does wrong from ``at`` on.

    Args:
        joint: The joint's name or its 0-based index; None is every joint.
        at: When it begins, >= 0 [s].
        samples: How many samples in a row are wrong, >= 1; None is all from then on.
    """

    kind: ClassVar[str]

    joint: str | int | None = setting(
        None, "a joint's name or its index from 0; all joints if absent", least=0.0
    )
    at: float = setting(0.0, "when it begins, >= 0", unit="s", least=0.0, needed=True)
    samples: int | None = setting(
        None, "how many samples in a row are wrong, >= 1; all from then on if absent", least=1.0
    )

    def __post_init__(self) -> None:
        non_negative("time of the sensor's fault", self.at, "s")
        if self.samples is not None and (type(self.samples) is not int or self.samples < 1):
            raise InputError(f"samples is {self.samples!r}, expected a whole number >= 1, or None for ever")
        for name, key in keys_of(type(self)).items():
            value = getattr(self, name)
            if key.hint is float and not isfinite(value):
                raise InputError(f"{name} is {value!r}, expected a finite number")

    @abstractmethod
    def spoil(
        self, reading: Reading, joints: slice, number: int, dt: float, generator: np.random.Generator
    ) -> None:
        """Change the reading of ``joints``.

        Args:
            reading: what is measured without this fault.
            joints: whose reading is wrong.
            number: of the sample since the fault began, from 0.
            dt: sampling period [s].
            generator: of everything random.
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class Frozen(SensorFault):
    """The encoder repeats its last reading."""

    kind: ClassVar[str] = "frozen"

    def spoil(
        self, reading: Reading, joints: slice, number: int, dt: float, generator: np.random.Generator
    ) -> None:
        """Repeat the sample before."""
        reading.q[joints], reading.v[joints] = reading.last_q[joints], reading.last_v[joints]


@dataclass(frozen=True, slots=True, kw_only=True)
class Dropped(SensorFault):
    """The encoder says nothing: the reading is NaN."""

    kind: ClassVar[str] = "dropped"

    def spoil(
        self, reading: Reading, joints: slice, number: int, dt: float, generator: np.random.Generator
    ) -> None:
        """Put NaN."""
        reading.q[joints] = reading.v[joints] = np.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class Offset(SensorFault):
    """The reading is off by a constant: a spike with few samples, a bias with many.

    Args:
        size: Added to the position [rad or m]; 2 pi is a wrapped angle.
        speed: Added to the velocity [rad/s or m/s].
    """

    kind: ClassVar[str] = "offset"

    size: float = setting(0.0, "added to the position; 6.2832 is a wrapped angle", unit="rad or m")
    speed: float = setting(0.0, "added to the velocity", unit="rad/s or m/s")

    def spoil(
        self, reading: Reading, joints: slice, number: int, dt: float, generator: np.random.Generator
    ) -> None:
        """Add the constants."""
        reading.q[joints] += self.size
        reading.v[joints] += self.speed


@dataclass(frozen=True, slots=True, kw_only=True)
class Drifting(SensorFault):
    """The reading runs away from the truth.

    Args:
        rate: How fast [rad/s or m/s].
    """

    kind: ClassVar[str] = "drifting"

    rate: float = setting(0.0, "how fast the reading runs away", unit="rad/s or m/s")

    def spoil(
        self, reading: Reading, joints: slice, number: int, dt: float, generator: np.random.Generator
    ) -> None:
        """Add what has drifted so far, and its rate."""
        reading.q[joints] += self.rate * (number + 1) * dt
        reading.v[joints] += self.rate


@dataclass(frozen=True, slots=True, kw_only=True)
class Scattered(SensorFault):
    """Some readings, chosen at random, are off by a random amount.

    Args:
        share: How many of the samples, in [0, 1].
        size: Standard deviation of the wrong ones [rad or m].
    """

    kind: ClassVar[str] = "scattered"

    share: float = setting(0.05, "share of wrong samples, 0 <= x <= 1", least=0.0, most=1.0)
    size: float = setting(0.5, "standard deviation of the wrong ones, >= 0", unit="rad or m", least=0.0)

    def __post_init__(self) -> None:
        SensorFault.__post_init__(self)
        non_negative("size", self.size, "rad")
        if not 0.0 <= self.share <= 1.0:
            raise InputError(f"share is {self.share!r}, expected a share of the samples in [0, 1]")

    def spoil(
        self, reading: Reading, joints: slice, number: int, dt: float, generator: np.random.Generator
    ) -> None:
        """Throw dice for each joint."""
        count = len(reading.q[joints])
        wrong = generator.random(count) < self.share
        reading.q[joints] += np.where(wrong, self.size * generator.standard_normal(count), 0.0)


SENSOR_KINDS: Mapping[str, type[Any]] = MappingProxyType(
    {kind.kind: kind for kind in (Frozen, Dropped, Offset, Drifting, Scattered)}
)
"""The kinds of sensor fault by the names that scenarios give them."""
