"""The loop between reference and arm in a record: its gains, what is learned, and how joints are judged."""

from typing import Any

import numpy as np

from ftqp.control.drive.joint_drive import BRAKES, KINDS, Drive, Noise
from ftqp.control.drive.servo_prior import fill_monitor
from ftqp.faults.detection.calibration import Calibration
from ftqp.model.robot import Robot


def fill_loop(
    K: Any, robot: Robot, dt: float, drive: Drive, noise: Noise, rate: float, known: Calibration | None
) -> None:
    """Write what follows from the drive, with so many false alarms an hour, and friction that is known."""
    feedback = K.feedback
    feedback.kind, feedback.latency = KINDS[drive.kind], drive.ticks(dt)
    a_max = float(np.min(robot.limits.a_max))
    paces = drive.paces(dt, noise, 6.0 * robot.length, a_max)
    K.learned.by_delay[: len(paces)] = paces
    feedback.span = feedback.latency + 1 + max(len(paces), 1)
    feedback.brakes = BRAKES[drive.brakes]
    feedback.speed = 1.0
    gains = drive.gains(dt, noise, 6.0 * robot.length, a_max)
    lead = gains.pop("lead")
    for name, value in gains.items():
        setattr(feedback, name, value)
    for name, value in drive.learning(dt, noise).items():
        setattr(K.learned, name, value)
    fill_monitor(K, robot, dt, drive, lead, rate, known)
