"""A calibration from logs of healthy motion, or the reason why they give none."""

from collections.abc import Sequence

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.faults.detection.calibration import Calibration
from ftqp.faults.detection.detector_settings import DetectorSettings
from ftqp.faults.detection.joint_friction import Friction, friction_of
from ftqp.faults.detection.motion_log import MotionLog
from ftqp.faults.detection.residual_thresholds import (
    BLOCK,
    FEWEST,
    FOLDS,
    TOP,
    largest_jumps,
    tested_thresholds,
)
from ftqp.kernel.entry.detection_session import DetectionSession
from ftqp.kernel.layout.enums import Residual
from ftqp.model.robot import Robot

STATED_SHARE = 0.5
"""Noise stated below this share of what the log shows is far too small."""
LEAST_WAY = 0.02
"""A joint whose reference moves by less [rad or m] never moves."""
OUTLIER = 4.0
"""A residual that exceeds the next largest, apart from its own second, by so many times is no healthy one."""
APART = 40
"""Blocks around the largest value that belong to it."""
EVERY = 3.0
"""No event in a time T bounds its rate by 3/T, 95 %, because exp(-3) is 0.05 (the rule of three)."""
GRID = 0.05
"""How exactly the steps of a quantised encoder are whole [quanta], because logs are rounded, too."""


def calibrated(
    settings: DetectorSettings, session: DetectionSession, robot: Robot, dt: float, delay: int,
    logs: Sequence[MotionLog], rate: float, *, extrapolate: bool,
) -> Calibration:  # fmt: skip
    """Noise, friction and thresholds of healthy motion, in this order.

    The session's record is used up; samples are ``delay`` ticks late, and ``rate`` alarms an hour are wanted,
    fewer than the log can show only with ``extrapolate``.
    """
    _refuse_unfit(robot, logs)
    hours = sum(len(log) for log in logs) * dt / 3600.0
    _refuse_short(logs, dt)
    if rate * hours < EVERY and not extrapolate:
        raise InputError(
            f"{3600.0 * hours:.3g} s of healthy motion show at best {EVERY / hours:.3g} false alarms an hour "
            f"(95 %), but {rate:g} are wanted, which takes {3600.0 * EVERY / rate:.6g} s; record "
            f"{EVERY / rate:.3g} h, ask for more alarms, or extrapolate=True"
        )
    quantum = max(settings.quantum, _quantum(logs))
    sigma = _noise(logs, quantum)
    noise = settings.noise
    if noise is not None and noise.q < STATED_SHARE * sigma:
        raise InputError(
            f"the noise of positions is stated as {noise.q:.2g} rad, but the log shows {sigma:.2g}; state "
            "what the encoders have"
        )
    has_torques = all(log.tau is not None or log.effort is not None for log in logs)
    none = Friction(np.zeros(robot.nv), np.zeros(robot.nv))
    friction = friction_of(robot, logs, dt, delay) if has_torques else none
    session.D.jump[: robot.nv] = largest_jumps(robot, dt, sigma, quantum)
    peaks = _peaks(session, logs, dt, sigma, quantum, friction)
    _refuse_outliers(robot, peaks, dt)
    folds = np.minimum(np.arange(len(peaks)) * FOLDS // len(peaks), FOLDS - 1)
    tail = tested_thresholds(peaks, folds, rate)
    return Calibration(
        joints=robot.joints, drive=settings.drive, dt=dt, bandwidths=settings.bandwidths, delay=delay,
        room=tail.room, sigma=sigma, quantum=quantum, coulomb=friction.coulomb, viscous=friction.viscous,
        hours=hours, rate=rate, alarms=tail.alarms, rate_low=tail.low, rate_high=tail.high,
        extrapolated=rate * hours < EVERY,
    )  # fmt: skip


def _refuse_unfit(robot: Robot, logs: Sequence[MotionLog]) -> None:
    """Refuse what no calibration can be made of."""
    if not logs:
        raise InputError("no log was given; record motion of the healthy arm as ftqp.MotionLog")
    way = np.zeros(robot.nv)
    for number, log in enumerate(logs):
        if log.nv != robot.nv:
            raise InputError(f"the log has {log.nv} joints, but {robot.name} has {robot.nv}")
        for name, column in log.columns().items():
            if column is not None and not np.isfinite(column).all():
                row, joint = np.argwhere(~np.isfinite(column))[0]
                raise InputError(
                    f"{name} of log {number} is not finite at row {row}, {robot.joints[joint]}: the log is "
                    "not healthy; leave that motion out"
                )
        way = np.maximum(way, np.ptp(log.q_ref, axis=0))
    if (way < LEAST_WAY).any():
        joint = int(np.argmin(way))
        raise InputError(
            f"{robot.joints[joint]} moves by {way[joint]:.2g} rad in all of the log, expected "
            f"{LEAST_WAY:g} at least; record motion in which every joint moves"
        )


def _refuse_short(logs: Sequence[MotionLog], dt: float) -> None:
    """Refuse logs whose largest residuals are too few to fit a tail to, extrapolated or not."""
    ticks = max(round(BLOCK / dt), 1)
    seconds, needed = sum(len(log) // ticks for log in logs) * BLOCK, FEWEST / TOP * BLOCK
    if seconds < needed:
        raise InputError(
            f"the log has {seconds:g} s of healthy motion, expected {needed:g} s at least: thresholds are "
            f"fitted to the largest {TOP:.0%} of the residuals, {FEWEST} or more, each that of "
            f"{1000.0 * BLOCK:g} ms; record more motion"
        )


def _quantum(logs: Sequence[MotionLog]) -> float:
    """The smallest step of the positions where all steps are multiples of it, else 0."""
    steps = np.abs(np.concatenate([np.diff(log.q[:4000], axis=0).ravel() for log in logs[:20]]))
    steps = steps[steps > 1e-12]
    if not len(steps):
        return 0.0
    least = float(np.min(steps))
    whole = steps / least
    return least if float(np.abs(whole - np.round(whole)).max()) < GRID else 0.0


def _noise(logs: Sequence[MotionLog], quantum: float) -> float:
    """Standard deviation of the positions beside their quantum, from third differences."""
    spread = []
    for log in logs:
        if len(log) > 8:
            third = np.diff(log.q, 3, axis=0)
            spread.append(np.median(np.abs(third - np.median(third, axis=0)), axis=0) / 0.6745)
    sigma = float(np.median(np.median(spread, axis=0))) / 20.0**0.5 if spread else 0.0
    return 0.0 if quantum > 0.0 and sigma < quantum else sigma


def _peaks(
    session: DetectionSession, logs: Sequence[MotionLog], dt: float, sigma: float, quantum: float,
    friction: Friction,
) -> FloatArray:  # fmt: skip
    """Largest residuals of blocks of 25 ms, (B, 9, nv); no suspicion holds the means."""
    D = session.D
    n = D.n
    D.sigma, D.quantum = sigma, quantum
    D.coulomb[:n], D.viscous[:n] = friction
    D.sharp[:] = 0.0
    D.faint[:] = 0.0
    block = max(round(BLOCK / dt), 1)
    found = []
    for number, log in enumerate(logs):
        D.fresh = 1
        D.peak[:] = 0.0
        _, peaks, _ = session.run(log.columns(), block)
        found.append(peaks[:, :, :n])
        for i in np.flatnonzero(D.kinds[:n]):
            raise InputError(
                f"the encoder of joint {i + 1} fails in log {number} at row {int(D.since[i])}: the log is "
                "not healthy; leave that motion out"
            )
    return np.concatenate(found)


def _refuse_outliers(robot: Robot, peaks: FloatArray, dt: float) -> None:
    """Refuse a log with a moment that stands out as a fault would."""
    for kind in Residual:
        if kind == Residual.ERROR:  # healthy servos lag in proportion to the motion
            continue
        for i in range(robot.nv):
            column = peaks[:, kind, i]
            at = int(np.argmax(column))
            rest = np.concatenate([column[: max(at - APART, 0)], column[at + APART :]])
            if len(rest) and rest.max() > 0.0 and column[at] > OUTLIER * rest.max():
                raise InputError(
                    f"{robot.joints[i]} stands out at {at * BLOCK:.2f} s of the log: "
                    f"{column[at] / rest.max():.1f} times the largest residual of all other motion; the log "
                    "is not healthy, or has that motion once only"
                )
