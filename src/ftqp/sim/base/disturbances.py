"""What moves a base: one signal a coordinate, as a function of time."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, final

import numpy as np

from ftqp.core.checks import FloatArray, non_negative, positive
from ftqp.core.errors import InputError
from ftqp.core.setting import Setting, Settings

COORDINATE = Setting(
    "track, rotation or tilt of a platform; x, y, z, rx, ry or rz of a free base",
    choices=("track", "rotation", "tilt", "x", "y", "z", "rx", "ry", "rz"),
)


def _number(name: str, value: Any) -> float:
    """``value`` as a finite float of either sign."""
    size = non_negative(name, abs(value) if isinstance(value, int | float) else value)
    return float(np.copysign(size, value))


class Disturbance(ABC):
    """The role of a disturbance: the deviation of some coordinates of a base from their nominal values."""

    @abstractmethod
    def sample(self, t: FloatArray) -> Mapping[str, FloatArray]:
        """The deviation of each coordinate it moves, by name, each (K,), at rising times t, (K,) [s]."""


@final
class Step(Disturbance):
    """From 0 to ``size`` at the time ``at``, at once or along a ramp."""

    settings: ClassVar[Settings] = {
        "coordinate": COORDINATE,
        "size": Setting("where it ends", unit="m or rad"),
        "at": Setting("when it begins, >= 0", unit="s", least=0.0),
        "rate": Setting("slope of a ramp, > 0; a jump if absent", unit="m/s or rad/s", above=0.0),
    }

    def __init__(self, coordinate: str, size: float, *, at: float = 0.0, rate: float | None = None) -> None:
        self._name, self._size = coordinate, _number("size of the step", size)
        self._at = non_negative("time of the step", at, "s")
        self._rate = np.inf if rate is None else positive("rate of the step", rate)

    def sample(self, t: FloatArray) -> Mapping[str, FloatArray]:
        since = t - self._at
        if np.isinf(self._rate):
            return {self._name: np.where(since >= -1e-9, self._size, 0.0)}
        way = np.clip(self._rate * since, 0.0, abs(self._size))
        return {self._name: np.copysign(way, self._size)}


@final
class Sinusoid(Disturbance):
    """A (sin(2 pi f t + phase) - sin phase): starts at 0."""

    settings: ClassVar[Settings] = {
        "coordinate": COORDINATE,
        "amplitude": Setting("amplitude", unit="m or rad"),
        "frequency": Setting("frequency, > 0", unit="Hz", above=0.0),
        "phase": Setting("phase", unit="rad"),
    }

    def __init__(self, coordinate: str, amplitude: float, *, frequency: float, phase: float = 0.0) -> None:
        self._name, self._amplitude = coordinate, _number("amplitude", amplitude)
        self._frequency = positive("frequency", frequency, "Hz")
        self._phase = _number("phase", phase)

    def sample(self, t: FloatArray) -> Mapping[str, FloatArray]:
        wave = np.sin(2.0 * np.pi * self._frequency * t + self._phase) - np.sin(self._phase)
        return {self._name: self._amplitude * wave}


@final
class RandomMotion(Disturbance):
    """Low-passed noise: x_k+1 = c x_k + sqrt(1 - c^2) rms w_k, c = exp(-2 pi f dt); starts at 0."""

    settings: ClassVar[Settings] = {
        "coordinate": COORDINATE,
        "rms": Setting("root mean square, >= 0", unit="m or rad", least=0.0),
        "corner": Setting("corner frequency, > 0", unit="Hz", above=0.0),
    }

    def __init__(self, coordinate: str, rms: float, *, corner: float, generator: np.random.Generator) -> None:
        self._name, self._rms = coordinate, non_negative("rms", rms)
        self._corner = positive("corner frequency", corner, "Hz")
        if not isinstance(generator, np.random.Generator):
            raise InputError(
                f"generator is {type(generator).__name__}, expected numpy.random.default_rng(seed)"
            )
        self._seed = int(generator.integers(2**63))

    def sample(self, t: FloatArray) -> Mapping[str, FloatArray]:
        """The deviation at times t; the same for the same times, however often it is asked."""
        from scipy.signal import lfilter  # half a second to load, needed for random motion only

        w = np.random.default_rng(self._seed).standard_normal(len(t))
        if len(t) < 2:
            return {self._name: np.zeros(len(t))}
        c = float(np.exp(-2.0 * np.pi * self._corner * (t[1] - t[0])))
        w[0] = 0.0
        moved = lfilter([self._rms * np.sqrt(1.0 - c * c)], [1.0, -c], w)
        return {self._name: np.asarray(moved, dtype=np.float64)}


@final
class Recorded(Disturbance):
    """Coordinates as they were recorded, linear between samples, held before the first and after the last."""

    def __init__(self, times: Any, values: Mapping[str, Any]) -> None:
        self._t = np.array(times, dtype=np.float64)
        self._values = {name: np.array(value, dtype=np.float64) for name, value in values.items()}
        if self._t.ndim != 1 or len(self._t) < 1 or not (np.diff(self._t) > 0.0).all():
            raise InputError("times of a recorded disturbance do not rise, expected (K,) rising numbers in s")
        for name, value in self._values.items():
            if value.shape != self._t.shape or not np.isfinite(value).all():
                raise InputError(
                    f"{name} of a recorded disturbance has shape {value.shape}, expected {self._t.shape} "
                    "finite numbers"
                )

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates it moves."""
        return tuple(self._values)

    def sample(self, t: FloatArray) -> Mapping[str, FloatArray]:
        return {name: np.interp(t, self._t, value) for name, value in self._values.items()}
