"""Gain, observer and noise of the loop that holds a tip in inertial space.

With the error e_k along inertial axes, the gain k_c and the attitude R that is believed of the base R_b, away
from singularities and limits e_k+1 = (1 - k_c R_b R') e_k - dv_k+1, dv the displacement of the tip that the
base makes in one sample. A believed attitude off by the angle alpha gives 1 - M the eigenvalues 1 - k_c and 1
- k_c e^(+-i alpha).

Source: Holt and Desrochers 1994. Their eq. 26, 2/sqrt(tan^2 alpha + 1) = 2 cos alpha, is the limit
of stability, not a gain to use: there |1 - k_c e^(i alpha)| = 1. The circle of radius k_c on which they place
the eigenvalues is that of M; the loop has those of 1 - M. The rest is not in the paper.
"""

from cmath import exp
from dataclasses import dataclass
from math import cos, log, pi, sqrt
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, non_negative, positive
from ftqp.core.errors import InputError
from ftqp.core.setting import setting

LARGEST_GAIN = 2.0
"""A gain from here on is unstable whatever the attitude, because 2 cos alpha is no larger
(docs/theory/moving-base.md, "Loop and stability")."""
SEARCH_FLOOR = 1e-6
"""Smallest low-pass factor that is looked at. At 1 kHz that is a time constant of 1000 s, so that nothing
below it is a filter any more."""


def gain_limit(alpha: float) -> float:
    """The gain 2 cos(alpha) below which the loop is stable; 0 from 90 deg on.

    With the attitude estimated from the end effector alpha is 0, whatever the base does, and the limit is 2.

    Args:
        alpha: Angle between the true and the believed attitude of the base, at most pi [rad].

    Source: Holt and Desrochers 1994, eq. 26, as the limit of stability that it is.
    """
    return 2.0 * best_gain(alpha)


def best_gain(alpha: float) -> float:
    """The gain cos(alpha) of the fastest decay, |sin(alpha)| a sample; 0 from 90 deg on.

    Gain 1 gives the decay 2 sin(alpha/2).

    Args:
        alpha: Angle between the true and the believed attitude of the base, at most pi [rad].
    """
    angle = abs(float(alpha))
    if not angle <= pi:
        raise InputError(f"alpha is {alpha!r}, expected an angle of at most pi in rad")
    return max(0.0, cos(angle))


def checked_gain(gain: Any) -> float:
    """``gain`` as a float inside the limit of stability for a base attitude that is right."""
    value = positive("gain", gain)
    if value >= LARGEST_GAIN:
        raise InputError(
            f"gain is {value:g}, but the loop is unstable from 2 on; expected 0 < gain < 2, 1 is usual"
        )
    return value


@dataclass(frozen=True, slots=True, kw_only=True)
class Observer:
    """One-step observer of the base's motion: dv <- dv + a (measured dv - dv), taken off in the next command.

    It is good for smooth base motion. With rough motion or noise it is harmful at a = 1, and a < 1 helps.
    Give the low-pass factor a, or noise and acceleration, from which it is chosen
    (``docs/theory/moving-base.md``).

    Args:
        lowpass: The factor a in (0, 1], without unit. Smaller filters more noise and follows the base later;
            1 takes the last sample as it is. None: 1.
        noise: Standard deviation of the measured position of the end effector along each axis, > 0 [m]. A
            larger one filters more.
        acceleration: Acceleration of the end effector by the base that is to be followed, rms of each axis, >
            0 [m/s2]. A larger one filters less.
        frozen: Whether dv is kept as it is after a step that limits have cut. It is off by default: the
            observer sees measured joint motion, so limits do not wind it up; freezing makes dv older.

    Raises:
        InputError: The factor is outside (0, 1], or noise and acceleration are not both given.
    """

    lowpass: float | None = setting(None, above=0.0, most=1.0)
    noise: float | None = setting(None, unit="m", above=0.0)
    acceleration: float | None = setting(None, unit="m/s2", above=0.0)
    frozen: bool = setting(False)

    def __post_init__(self) -> None:
        if (self.noise is None) != (self.acceleration is None):
            raise InputError("observer has one of noise and acceleration; the low-pass factor needs both")
        if self.lowpass is not None and self.noise is not None:
            raise InputError("observer has lowpass and noise; give one of them")
        if self.lowpass is not None and not 0.0 < positive("lowpass", self.lowpass) <= 1.0:
            raise InputError(f"lowpass is {self.lowpass:g}, expected a factor in (0, 1]; 1 does not filter")
        if self.noise is not None and self.acceleration is not None:
            positive("noise", self.noise, "m")
            positive("acceleration", self.acceleration, "m/s2")

    def factor(self, dt: float, gain: float = 1.0) -> float:
        """The low-pass factor a.

        Args:
            dt: Sampling period, > 0 [s].
            gain: The loop's gain k_c, in (0, 2).
        """
        if self.noise is not None and self.acceleration is not None:
            return best_lowpass(self.noise, self.acceleration, dt, gain)
        return 1.0 if self.lowpass is None else float(self.lowpass)


def sensitivity(omega: Any, dt: float, gain: float = 1.0, observer: Observer | None = None) -> FloatArray:
    """|S|: amplitude of the error over that of the base's motion, in the shape of ``omega``.

    |S| = |1 - z^-1| / |1 - (1 - k_c) z^-1|, z = e^(i omega dt); with the observer times |1 - z^-1| / |1 - (1
    - a) z^-1|. It is about omega dt/k_c for slow motion and 1 at cos(omega dt) = 1 - k_c/2; above that,
    motion is amplified, by at most 2/(2 - k_c): the loop passes fast base motion, not slow.

    Args:
        omega: Frequency of the base's motion, a number or an array [rad/s].
        dt: Sampling period, > 0 [s]. A longer one rejects less.
        gain: The loop's gain k_c, in (0, 2). A larger one rejects slow motion and amplifies fast motion more.
        observer: The disturbance observer, or None.
    """
    back = np.exp(-1j * np.asarray(omega, dtype=np.float64) * positive("dt", dt, "s"))
    k_c = checked_gain(gain)
    result = np.abs(1.0 - back) / np.abs(1.0 - (1.0 - k_c) * back)
    if observer is not None:
        result = result * np.abs(1.0 - back) / np.abs(1.0 - (1.0 - observer.factor(dt, k_c)) * back)
    return np.asarray(result, dtype=np.float64)


def noise_gain(gain: float = 1.0, lowpass: float | None = None) -> float:
    """Variance of the true error over that of white noise of the measured tip.

    It is k_c/(2 - k_c) without observer. With it the noise passes (b0 - b1 z^-1)/((1 - (1-a) z^-1)(1 -
    (1-k_c) z^-1)), b0 = k_c + a, b1 = k_c (1 - a) + a; at k_c = 1 that is (2 + 3a)/(2 - a).
    """
    k_c = checked_gain(gain)
    if lowpass is None:
        return k_c / (2.0 - k_c)
    a = positive("lowpass", lowpass)
    b0, b1 = k_c + a, -(k_c * (1.0 - a) + a)
    a1, a2 = -(2.0 - a - k_c), (1.0 - a) * (1.0 - k_c)
    above = (b0 * b0 + b1 * b1) * (1.0 + a2) - 2.0 * b0 * b1 * a1
    return above / ((1.0 - a2) * (1.0 + a1 + a2) * (1.0 - a1 + a2))


def best_lowpass(noise: float, acceleration: float, dt: float, gain: float = 1.0) -> float:
    """The observer's low-pass factor with the least mean square error for this noise and acceleration.

    Noise leaves noise^2 noise_gain(k_c, a), a steady acceleration A of the base the lag A dt^2/(a k_c). The
    sum of the first and the square of the second is least, at k_c = 1, where a^(3/2) = (1 - a/2) A
    dt^2/noise; without a solution below 1, a = 1.
    """
    sigma, k_c = positive("noise", noise, "m"), checked_gain(gain)
    moved = positive("acceleration", acceleration, "m/s2") * positive("dt", dt, "s") ** 2

    def cost(x: float) -> float:
        a = float(np.exp(x))
        return sigma**2 * noise_gain(k_c, a) + (moved / (a * k_c)) ** 2

    low, high, ratio = log(SEARCH_FLOOR), 0.0, 0.5 * (sqrt(5.0) - 1.0)
    while high - low > 1e-9:
        left, right = high - ratio * (high - low), low + ratio * (high - low)
        if cost(left) < cost(right):
            high = right
        else:
            low = left
    return min(1.0, float(np.exp(0.5 * (low + high))))


def decay(gain: float, alpha: float) -> float:
    """Factor by which the slowest part of the error shrinks in one sample.

    max(|1 - k_c|, |1 - k_c e^(i alpha)|)
    """
    k_c = non_negative("gain", gain)
    return max(abs(1.0 - k_c), abs(1.0 - k_c * exp(1j * float(alpha))))
