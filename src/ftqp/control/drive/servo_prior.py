"""What a planner supposes of servos on positions before it has seen them, and how it judges them."""

from math import exp, log
from typing import Any, Final

import numpy as np

from ftqp.control.drive.joint_drive import BRAKES, KINDS, Drive, Noise
from ftqp.control.drive.learned_servos import LearnedServos
from ftqp.core.checks import FloatArray
from ftqp.faults.calibration import Calibration
from ftqp.kernel.layout.feedback_rooms import SERVO
from ftqp.kernel.layout.thresholds import SERVO_DRIFT, SERVO_PRIOR, SPEED_SERVO_PRIOR, TORQUE_PRIOR
from ftqp.model.robot import Robot

FALSE_ALARMS: Final = 0.1
"""How often an hour a healthy arm may be accused unless something else is asked for."""
CORNER, CORNER_DT = 100.0, 0.6
"""Corner of the filters [1/s], and what it is at most times dt: faster ones pass noise on,
and what a servo of 60 Hz does is done by then."""
BLOCK = 0.005
"""From one look at a joint to the next [s]: half of the time that the filters take."""
ALIKE = 5.33
"""White noise behind three poles at w is alike for so many times 1/w: the sum of its autocorrelation."""
SHARE = 4
"""So many hypotheses share the rate of false alarms: locked, without motor, held, pushed."""
LASTS = 0.15
"""Motion that was asked for counts for so long [s], the slowest servo's time."""
LONG = 40.0
"""The filters have forgotten a sample after so many of their time constants."""
MOST = 4.0
"""Evidence is kept up to so many times what decides, so that it is gone soon once it is contradicted."""
MEAN_LAG = 0.0
"""A servo of which nothing is known lags by so much [s] in the mean."""
TOLD_SHARE = 0.1
"""A bandwidth is stated to so much."""
STICKS = 30.0
"""Dry friction takes so much of a rotor's acceleration [rad/s2]: behind a servo of 4 Hz, all that is open."""
SHOWN = 0.0025
"""Dry friction is open to what a joint goes at its limit in this time [s]: eight times as much may be led."""
LEAST_TORQUE = 50.0
"""The torque limit of a joint that has none [N m or N], a unit of its weight."""
CHANGES, LEAST_FRICTION = 0.3, 0.05
"""Friction that was identified may be so much of itself larger or smaller now, and so many fifths of the
torque limit."""
LEAST_ROTOR = 1e-3
"""A rotor that was stated is open to so much [kg m2 or kg]."""
WEIGHS = 0.2
"""The unit of torques as a share of the limit: about what common arms weigh."""


def prior(drive: Drive, joints: int, lead: float, late: float) -> tuple[FloatArray, FloatArray]:
    """What is stated of the servos, and its standard deviations, (joints, SERVO) each.

    What was learned before is as open as if the joints had gone a radian or metre since, its lag and rotor at
    least as those of a bandwidth that was stated.
    """
    most = np.array(SPEED_SERVO_PRIOR if drive.kind == "velocity" else SERVO_PRIOR)
    if isinstance(drive.known, LearnedServos):
        mean = np.array(drive.known.values)
        doubt = np.hypot(drive.known.deviations, SERVO_DRIFT)
        doubt[:, 0] = np.maximum(doubt[:, 0], TOLD_SHARE * mean[:, 0])
        doubt[:, 1] = np.maximum(doubt[:, 1], 0.25 * mean[:, 0] ** 2)
        return mean, np.minimum(doubt, most)
    mean, doubt = np.zeros((joints, SERVO)), np.tile(most, (joints, 1))
    mean[:, 0] = MEAN_LAG + late
    if drive.bandwidth is not None:
        lags = np.broadcast_to(2.0 / np.asarray(drive.bandwidth, dtype=float), (joints,))
        if drive.kind == "velocity":  # 1/w, or nothing and m = 4/w^2 where it has an integral part
            mean[:, 0], doubt[:, 0] = late + 0.25 * lags, 0.25 * lags
            doubt[:, 1] = lags**2
            return mean, doubt
        mean[:, 0] = late + (0.0 if drive.takes_velocity else lags)
        doubt[:, 0] = TOLD_SHARE * lags
        doubt[:, 1] = 0.25 * lags**2  # 1/w^2
        doubt[:, 2] = np.minimum(0.25 * STICKS * lags**2, most[2])
    elif lead > 0.0:
        mean[:, 0] = lead + late
    return mean, doubt


def fill_loop(
    K: Any, robot: Robot, dt: float, drive: Drive, noise: Noise, rate: float, known: Calibration | None
) -> None:
    """Write what follows from the drive, with so many false alarms an hour, and friction that is known."""
    feedback = K.feedback
    feedback.kind, feedback.latency = KINDS[drive.kind], drive.ticks(dt)
    a_max = float(np.min(robot.limits.a_max))
    paces = drive.paces(dt, noise, 6.0 * robot.length, a_max)
    K.learned.paces[:, : paces.shape[1]] = paces
    feedback.span = feedback.latency + 1 + max(paces.shape[1], 1)
    feedback.brakes = BRAKES[drive.brakes]
    feedback.speed = 1.0
    gains = drive.gains(dt, noise, 6.0 * robot.length, a_max)
    lead = gains.pop("lead")
    for name, value in gains.items():
        setattr(feedback, name, value)
    for name, value in drive.learning(dt, noise).items():
        setattr(K.learned, name, value)
    _fill_monitor(K, robot, dt, drive, lead, rate, known)


def _fill_monitor(
    K: Any, robot: Robot, dt: float, drive: Drive, lead: float, rate: float, known: Calibration | None
) -> None:
    """Write how the joints of this arm are learned and judged into a record."""
    M, n = K.monitor, robot.nv
    M.on = int(drive.kind != "torque")
    M.every = every = max(1, round(BLOCK / dt))
    M.w = w = min(CORNER, CORNER_DT / dt)
    M.pole = pole = exp(-w * dt)
    M.D = (1.0 - pole) / (pole * dt)
    alike, block = ALIKE / w, every * dt
    M.kappa = min(1.0, block / alike)
    M.level = log(max(3600.0 / max(alike, block) * n * SHARE / rate, 1.0))
    M.top = MOST * M.level
    M.decay = exp(-block / LASTS)
    k = np.arange(round(LONG / (w * dt)))
    one = (1.0 - pole) * pole**k  # what one, two and three poles make of a sample of 1
    two = (1.0 - pole) * (k + 1.0) * one
    three = (1.0 - pole) * (0.5 * k + 1.0) * two
    M.blurs[:] = np.sum((M.D * (two - three)) ** 2), np.sum((M.D**2 * (one - 2.0 * two + three)) ** 2)
    if drive.kind == "velocity":
        M.leak, M.fades = 1.0 - exp(-dt / LASTS), 1.0 - M.decay
    limits = np.where(np.isfinite(robot.limits.tau_max), robot.limits.tau_max, LEAST_TORQUE)
    M.unit[:n] = 1.0 / (WEIGHS * limits)
    M.stated[:n], M.doubt[:n] = prior(drive, n, lead, drive.latency)
    if drive.kind == "position":  # else no lead that is safe would show that a joint stands
        M.doubt[:n, 2] = np.minimum(M.doubt[:n, 2], SHOWN * robot.limits.v_max)
    if drive.kind == "torque":
        M.stated[:n], M.doubt[:n] = 0.0, TORQUE_PRIOR
        M.doubt[:n, 1] = np.maximum(drive.doubt, LEAST_ROTOR) * M.unit[:n]
        M.stated[:n, 2] = robot.coulomb * M.unit[:n]  # or the arm has none of it
        M.doubt[:n, 2] = np.maximum(M.doubt[:n, 2], M.stated[:n, 2])
        if known is not None:
            for at, friction in ((0, known.viscous), (2, known.coulomb)):
                M.stated[:n, at] = friction * M.unit[:n]
                M.doubt[:n, at] = np.minimum(
                    M.doubt[:n, at], CHANGES * np.abs(M.stated[:n, at]) + LEAST_FRICTION
                )
    M.stated_lead[:n] = lead


def forget_servos(K: Any, joints: int) -> None:
    """Let nothing be known of the servos until the next reset, whatever was stated or estimated of them."""
    M = K.monitor
    mean, doubt = prior(Drive(), joints, 0.0, float(K.feedback.latency) * float(K.state.dt))
    M.theta[:joints] = M.safe[:, :joints] = mean
    for i in range(joints):
        M.P[i] = M.safe_P[:, i] = np.diag(doubt[i] ** 2)


def tell_servos(K: Any, learned: LearnedServos) -> None:
    """Let what was estimated of the servos count as stated from the next reset on."""
    n = len(learned.joints)
    K.monitor.stated[:n], K.monitor.doubt[:n] = prior(Drive(known=learned), n, 0.0, 0.0)
