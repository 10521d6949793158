"""A calibration from logs of healthy motion, or the reason why they give none."""

from collections.abc import Sequence

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.faults.calibration import Calibration
from ftqp.faults.motion_log import MotionLog
from ftqp.model.fitting.fitted_arm import arm_of
from ftqp.model.fitting.torque_log import TorqueLog
from ftqp.model.robot import Robot

SIGNIFICANT = 3.0
"""Friction below so many standard errors is none, because noise alone makes that in 0.3 % of logs."""
MOST_PIECES = 3000
"""More pieces of motion show no more."""
STATED_SHARE = 0.5
"""Noise stated below this share of what the log shows is far too small."""
LEAST_WAY = 0.02
"""A joint whose reference moves by less [rad or m] never moves."""
GRID = 0.05
"""How exactly the steps of a quantised encoder are whole [quanta], because logs are rounded, too."""


def _friction(
    robot: Robot, logs: Sequence[MotionLog], dt: float, delay: int
) -> tuple[FloatArray, FloatArray]:
    """Coulomb and viscous friction beside the model's, (nv,) each, where they show: zeros elsewhere.

    Least squares with an unknown load at the tip and rotors: docs/how-to/identify.md.
    """
    found = arm_of(
        robot,
        [_torques(log, dt, delay) for log in logs],
        ("rotors", "coulomb", "viscous", "load"),
        MOST_PIECES,
    )
    coulomb, viscous = found.coulomb, found.viscous
    rubs = ~found.not_shown["coulomb"] & (coulomb > SIGNIFICANT * found.errors["coulomb"])
    flows = ~found.not_shown["viscous"] & (np.abs(viscous) > SIGNIFICANT * found.errors["viscous"])
    return np.where(rubs, coulomb, 0.0), np.where(rubs | flows, viscous, 0.0)


def _torques(log: MotionLog, dt: float, delay: int) -> TorqueLog:
    """The log with the torques of its motors; those that were sent act later than samples were taken."""
    t: FloatArray = dt * np.arange(len(log), dtype=np.float64)
    if log.tau is not None:
        return TorqueLog(t=t, q=log.q, tau=log.tau)
    assert log.effort is not None
    return TorqueLog(t=t, q=log.q, tau=log.effort, late=(delay + 0.5) * dt)


def calibrated(
    robot: Robot, dt: float, drive: str, delay: int, stated: float | None, logs: Sequence[MotionLog]
) -> Calibration:
    """Noise and friction of healthy motion with samples ``delay`` ticks late; ``stated`` is the noise."""
    _refuse_unfit(robot, logs)
    quantum = _quantum(logs)
    sigma = _noise(logs, quantum)
    if stated is not None and stated < STATED_SHARE * sigma:
        raise InputError(
            f"the noise of positions is stated as {stated:.2g} rad, but the log shows {sigma:.2g}; state "
            "what the encoders have"
        )
    coulomb, viscous = np.zeros(robot.nv), np.zeros(robot.nv)
    if robot.has_inertia and all(log.tau is not None or log.effort is not None for log in logs):
        coulomb, viscous = _friction(robot, logs, dt, delay)
    return Calibration(
        joints=robot.joints, drive=drive, dt=dt, sigma=sigma, quantum=quantum, coulomb=coulomb,
        viscous=viscous, hours=sum(len(log) for log in logs) * dt / 3600.0,
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
