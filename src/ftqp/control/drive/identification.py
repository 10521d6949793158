"""How far a servo lags behind what it was sent, from a log of a healthy arm."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ftqp.control.drive.joint_drive import Drive
from ftqp.core.checks import FloatArray, array, non_negative, positive
from ftqp.core.errors import InputError

BLOCK = 21
"""Samples that are averaged before they are looked at, because noise falls with the root of them
(docs/theory/feedback.md, "Bandwidth from a log")."""
SLOWEST = 0.02
"""Joints slower than this [rad/s or m/s] tell nothing of a lag. Encoder noise and friction hide the lag
there."""
FEWEST = 40
"""Averaged samples that the regression needs at least."""
SIGNIFICANT = 3.0
"""A lag below so many standard deviations is none, because noise alone makes that in 0.3 % of logs ..."""
LEAST = 2e-3
"""... and neither is one below this [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoLag:
    """What a log shows of a position servo.

    Attributes:
        lag: How late the joints are on top of the latency of the samples [s].
        deviation: Its standard deviation [s].
        drive: What to make the planner with: a servo on positions only gets its bandwidth and a lead; one
            that does not lag is taken for one that uses velocities, too, its bandwidth unknown.
    """

    lag: float
    deviation: float
    drive: Drive


def servo_lag(sent: Any, measured: Any, dt: float, latency: float = 0.0) -> ServoLag:
    """The lag of a position servo, by least squares over all joints of a healthy arm.

    e = q_sent - q_measured = lag v + beta a + f_j sign(v_j) + b_j, each averaged over 21 samples. Take two
    seconds or more of a motion without LAGGING, RELAXED or faults, recorded with ``drive="position"`` and no
    lead.

    Args:
        sent: ``step.q`` of every tick, (K, nv) [rad or m].
        measured: The samples that were handed to the same ticks, (K, nv).
        dt: The sampling period, > 0 [s].
        latency: How late the samples are, >= 0 [s].

    Raises:
        InputError: A wrong shape, or too little motion.

    Source: docs/theory/feedback.md, "Bandwidth from a log".
    """
    dt, latency = positive("dt", dt, "s"), non_negative("latency", latency, "s")
    q = array("measured", measured, np.shape(measured), "(K, nv)")
    if q.ndim != 2:
        raise InputError(f"measured has shape {q.shape}, expected (K, nv)")
    command = array("sent", sent, q.shape, "(K, nv)")
    error = _means(command[:-1] - q[1:])
    place = _means(q[1:])
    v = np.gradient(place, BLOCK * dt, axis=0) if len(place) > 2 else np.zeros_like(place)
    a = np.gradient(v, BLOCK * dt, axis=0) if len(place) > 2 else np.zeros_like(place)
    moving = np.abs(v) > SLOWEST
    moving[[0, -1]] = False  # one-sided differences
    count, n = int(moving.sum()), q.shape[1]
    if count < FEWEST:
        raise InputError(
            f"the log has {count} averaged samples of joints faster than {SLOWEST:g} rad/s, expected "
            f"at least {FEWEST}; record a longer or faster motion of the healthy arm"
        )
    joint = np.nonzero(moving)[1]
    rows = np.zeros((count, 2 + 2 * n))
    rows[:, 0], rows[:, 1] = v[moving], a[moving]
    rows[np.arange(count), 2 + joint] = np.sign(v[moving])
    rows[np.arange(count), 2 + n + joint] = 1.0
    found, _, rank, _ = np.linalg.lstsq(rows, error[moving], rcond=None)
    left = error[moving] - rows @ found
    spread = float(left @ left) / max(count - int(rank), 1)
    deviation = float(np.sqrt(spread * np.linalg.pinv(rows.T @ rows)[0, 0]))
    lag = float(found[0]) - latency
    if lag > max(LEAST, SIGNIFICANT * deviation):
        drive = Drive(bandwidth=2.0 / lag, takes_velocity=False, lead=lag, latency=latency)
    else:
        drive = Drive(latency=latency)
    return ServoLag(lag=lag, deviation=deviation, drive=drive)


def _means(samples: FloatArray) -> FloatArray:
    """Means over blocks of ``BLOCK`` samples, (K // BLOCK, nv)."""
    count = len(samples) // BLOCK
    result: FloatArray = samples[: count * BLOCK].reshape(count, BLOCK, -1).mean(axis=1)
    return result
