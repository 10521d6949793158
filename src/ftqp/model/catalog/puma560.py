"""Unimation PUMA 560."""

from math import pi

import numpy as np

from ftqp.model.robot import Robot
from ftqp.model.serial import placement

TABLE = (
    (0.0, 0.0, 0.0, pi / 2),
    (0.0, 0.0, 0.4318, 0.0),
    (0.0, 0.15005, 0.0203, -pi / 2),
    (0.0, 0.4318, 0.0, pi / 2),
    (0.0, 0.0, 0.0, -pi / 2),
    (0.0, 0.0, 0.0, 0.0),
)
"""Standard Denavit-Hartenberg rows (theta, d, a, alpha) [rad, m, m, rad]."""

TOOL = 0.10
"""Distance of the tool point from the wrist centre along z of frame 6 [m]."""


def puma560() -> Robot:
    """Unimation PUMA 560: 6 joints, kinematics only, tool 0.10 m behind the wrist centre.

    Source: Corke and Armstrong 1994 for the Denavit-Hartenberg table and position limits, as in Corke's
    Robotics Toolbox. Tool, the speed of 90 deg/s and the characteristic length of 0.20 m are choices of the
    studies of a moving base; acceleration ``v_max / RISE_TIME``. The start is 0, 45, 180, 0, 45, 0 deg of
    those studies, joint 3 written as -180 deg because its range is -225 to 45 deg.
    """
    return Robot.from_dh(
        TABLE,
        name="puma560",
        limits={
            "q_min": np.deg2rad([-160.0, -45.0, -225.0, -110.0, -100.0, -266.0]),
            "q_max": np.deg2rad([160.0, 225.0, 45.0, 170.0, 100.0, 266.0]),
            "v_max": np.deg2rad(90.0),
        },
        tool=placement((0.0, 0.0, TOOL)),
        neutral=np.deg2rad([0.0, 45.0, -180.0, 0.0, 45.0, 0.0]),
        length=0.20,
    )
