"""How large healthy residuals become: by the noise alone, or by the tail of what a log shows."""

from math import log, sqrt
from typing import NamedTuple

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.kernel.layout.enums import Residual
from ftqp.kernel.layout.thresholds import NOISE_OF_D
from ftqp.model.followers import is_led
from ftqp.model.robot import Robot

BLOCK = 0.025
"""Healthy residuals are taken as the largest of so long a time [s]. The slow observer forgets within 1/60 s,
so that the largest values are nearly independent (docs/theory/detection.md, "Thresholds")."""
TOP = 0.01
"""The tail is fitted to this share of them, the 99th percentile and beyond by convention, ..."""
FEWEST = 20
"""... but to so many at least, because an exponential's mean is then known to a fifth or so."""
ROOM = 1.15
"""A threshold is at least so many times the largest healthy value."""
FOLDS = 3
"""Parts of a log that are tested with thresholds of the others."""


SIGMAS = 12.0
"""An arm of which no log is known gets so many standard deviations ..."""
ERROR_UNKNOWN = 5e-3
"""... beside this error of position [rad or m] ..."""
SHARES_UNKNOWN = (0.05, 0.15)
"""... and beside these shares of its largest acceleration or torque, slow and fast."""

JUMP_MOST = 8e-3
"""A sample that jumps by more than this [rad or m] was not moved by a motor."""
JUMP_MARGIN = 1.3
"""A motor may give so many times its torque limit for a tick."""
JUMP_SIGMAS = 8.0 * sqrt(6.0)
"""Eight standard deviations of the second difference of noise, which is sqrt(1 + 4 + 1) of noise's own: so
that noise is none."""
JUMP_QUANTA = 3.0
"""Second differences of rounded numbers are below so many steps, because (1 + 2 + 1)/2 of them is the
most."""
JUMP_LEAST = 1e-4
"""A smaller jump [rad or m] is none."""


def noise_of_acceleration(sigma: float, bandwidth: float, dt: float) -> float:
    """Standard deviation of d [rad/s2 or m/s2]: sqrt(3)/4 sigma w^(5/2) dt^(1/2).

    Source: docs/theory/detection.md, "Observers".
    """
    return NOISE_OF_D * sigma * bandwidth * bandwidth * sqrt(bandwidth * dt)


def uncalibrated(
    robot: Robot, dt: float, bandwidths: tuple[float, float], sigma: float, sigma_tau: float
) -> FloatArray:
    """Thresholds of an arm of which no log is known, (9, nv): twelve standard deviations and some room.

    ``sigma`` is the noise of positions [rad or m], ``sigma_tau`` that of torques [N m or N].
    """
    limits = robot.limits
    room = np.full((len(Residual), robot.nv), np.inf)
    room[Residual.ERROR] = ERROR_UNKNOWN + SIGMAS * sigma
    inertia = np.diag(robot.mass_matrix(robot.neutral)) if robot.has_inertia else np.zeros(robot.nv)
    rows = zip(
        bandwidths,
        SHARES_UNKNOWN,
        (Residual.ACCELERATION_SLOW, Residual.ACCELERATION_FAST),
        (Residual.TORQUE_SLOW, Residual.TORQUE_FAST),
        (Residual.MOTOR_SLOW, Residual.MOTOR_FAST),
        (Residual.OWN_SLOW, Residual.OWN_FAST),
        strict=True,
    )
    for bandwidth, share, acceleration, torque, motor, own in rows:
        noise = SIGMAS * noise_of_acceleration(sigma, bandwidth, dt)
        room[acceleration] = noise + share * limits.a_max
        room[torque] = noise * inertia + share * limits.tau_max
        with np.errstate(divide="ignore", invalid="ignore"):
            room[own] = np.where(inertia > 0.0, room[torque] / inertia, np.inf)
        room[motor] = SIGMAS * sigma_tau * sqrt(bandwidth * dt) + share * limits.tau_max
    return room


def largest_jumps(robot: Robot, dt: float, sigma: float, quantum: float) -> FloatArray:
    """The largest second difference of samples that motion explains, (nv,) [rad or m].

    min(8 mrad, 1.3 a dt^2), a = tau_max (M^-1)_ii, but not below 8 sqrt(6) sigma + 3 quanta. M has 1 on the
    diagonal where a joint mimics another.
    """
    most = np.full(robot.nv, JUMP_MOST)
    if robot.has_inertia:
        inverse = np.linalg.inv(robot.mass_matrix(robot.neutral) + np.diag(1.0 * is_led(robot.chain)))
        most = np.minimum(most, JUMP_MARGIN * robot.limits.tau_max * np.diag(inverse) * dt * dt)
    least: FloatArray = np.maximum(most, max(JUMP_SIGMAS * sigma + JUMP_QUANTA * quantum, JUMP_LEAST))
    return least


class Tail(NamedTuple):
    """Thresholds and how they did on parts of the log that they had not seen.

    Attributes:
        room: Thresholds, (9, nv); infinite where there is no such residual.
        alarms: Alarms on unseen parts.
        low: Lower end of the 95 % interval of their rate [1/h].
        high: Upper end.
    """

    room: FloatArray
    alarms: int
    low: float
    high: float


def thresholds(peaks: FloatArray, rate: float) -> FloatArray:
    """T of every residual and joint so that all together are passed ``rate`` times an hour.

    Above the 99th percentile u the largest values of 25 ms are taken to fall off exponentially, with the mean
    excess b: T = u + b log(0.01 K m/rate), K blocks an hour and m residuals; at least 1.15 times the largest.

    ``peaks`` are the largest values of blocks of 25 ms, (B, 9, nv).

    Source: docs/theory/detection.md, "Thresholds".
    """
    present = peaks.max(axis=0) > 0.0
    count = max(FEWEST, int(TOP * len(peaks)))
    top = np.sort(peaks, axis=0)[-count - 1 :] if len(peaks) > count else np.sort(peaks, axis=0)
    excess = (top[1:] - top[0]).mean(axis=0) if len(top) > 1 else np.zeros(peaks.shape[1:])
    share = (len(top) - 1) / len(peaks)
    factor = max(log(share * 3600.0 / BLOCK * int(present.sum()) / rate), 0.0) if share > 0.0 else 0.0
    room = np.maximum(top[0] + factor * excess, ROOM * peaks.max(axis=0))
    return np.where(present, room, np.inf)


def interval(alarms: int, hours: float) -> tuple[float, float]:
    """The exact 95 % interval of a rate [1/h] of which so many events were seen in so many hours."""
    from scipy.stats import chi2  # a second to load, needed by a calibration only

    low = float(chi2.ppf(0.025, 2 * alarms)) / 2.0 if alarms else 0.0
    tail = 0.05 if alarms == 0 else 0.025
    return low / hours, float(chi2.ppf(1.0 - tail, 2 * alarms + 2)) / 2.0 / hours


def tested_thresholds(peaks: FloatArray, folds: IntArray, rate: float) -> Tail:
    """Thresholds from all of the log, and the alarms that those of two thirds raise on the third one.

    ``folds`` says which part each block of ``peaks`` belongs to, (B,).
    """
    alarms = 0
    for part in range(FOLDS):
        rest, unseen = peaks[folds != part], peaks[folds == part]
        if len(rest) and len(unseen):
            loud = (unseen > thresholds(rest, rate)).any(axis=(1, 2))
            alarms += int((loud & ~np.concatenate([[False], loud[:-1]])).sum())
    low, high = interval(alarms, len(peaks) * BLOCK / 3600.0)
    return Tail(thresholds(peaks, rate), alarms, low, high)
