"""The record of a detector before its first tick: observers, filters, thresholds of one arm."""

from math import exp
from typing import Any

import numpy as np

from ftqp.faults.detection.detector_settings import DetectorSettings
from ftqp.faults.detection.joint_friction import SLOWEST
from ftqp.faults.detection.residual_thresholds import largest_jumps, uncalibrated
from ftqp.kernel.layout.detection_room import LOAD_EVERY
from ftqp.kernel.layout.enums import Residual
from ftqp.model.followers import is_led
from ftqp.model.robot import Robot

MEAN = 0.2
"""Time constant of the means that are taken from residuals [s]."""
LOAD = 3.0
"""Time constant by which what was seen of an unknown load fades [s]."""
FINEST = 1e-3
"""Residuals of torque below this share of a joint's largest torque tell no more of a load."""
SETTLE = 150
"""Ticks after a reset before measured torques are looked at, and means are begun."""
FAINT = 0.5
"""A residual of torque below this share of its threshold shows no acceleration of a light joint either."""

LEAST_ROOM = 1e-100
"""A residual with less room than this is none to decide by. So that a quotient by it stays finite; any number
far below real residuals does."""


def fill_record(D: Any, settings: DetectorSettings, robot: Robot, dt: float, ticks: int) -> None:
    """Write into a record what a detector counts on whose samples of an arm are so many ticks late."""
    bandwidths, known, noise = settings.bandwidths, settings.calibration, settings.noise
    sigma, sigma_tau = (0.0, 0.0) if noise is None else (noise.q, noise.tau)
    n = robot.nv
    D.dt, D.latency, D.span = dt, ticks, ticks + 2
    for b, w in enumerate(bandwidths):
        p = exp(-w * dt)
        D.pole[b], D.k_s[b] = p, 1.0 - p**3
        D.k_w[b], D.k_d[b] = 1.5 * (1.0 - p) ** 2 * (1.0 + p) / dt, (1.0 - p) ** 3 / dt**2
    D.patience, D.settle = round(settings.patience / dt), SETTLE
    D.bandwidth_fast = bandwidths[1]
    D.slowness, D.slip = dt / MEAN, SLOWEST
    strongest = np.where(np.isfinite(robot.limits.tau_max), robot.limits.tau_max, 1.0)
    D.finest[:n] = np.maximum(FINEST * strongest, 1e-6) ** 2
    D.load_fade = 1.0 - LOAD_EVERY * dt / LOAD
    D.quantum = settings.quantum
    if known is None:
        room = uncalibrated(robot, dt, bandwidths, sigma, sigma_tau)
        D.coulomb[:n] = robot.coulomb
        D.told_coulomb[:n] = np.where(robot.coulomb > 0.0, robot.coulomb, -1.0)
    else:
        room = known.room
        sigma, D.quantum = known.sigma, max(known.quantum, settings.quantum)
        D.coulomb[:n], D.viscous[:n] = known.coulomb, known.viscous
        D.told_coulomb[:n] = known.coulomb
    D.sigma = sigma
    with np.errstate(divide="ignore", over="ignore"):
        D.sharp[:, :n] = np.where(room > LEAST_ROOM, 1.0 / room, 0.0)
    D.room[:, :n] = np.where(np.isfinite(room), room, 1e30)
    D.faint[:n] = np.where(np.isfinite(room[Residual.TORQUE_SLOW]), FAINT, 0.0)
    D.tau_max[:n] = robot.limits.tau_max
    D.believed[:n] = D.blind[:n] = is_led(robot.chain)  # a joint that mimics another is judged with that
    D.jump[:n] = largest_jumps(robot, dt, sigma, float(D.quantum))
