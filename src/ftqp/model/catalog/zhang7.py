"""The seven-joint arm of Zhang et al."""

from math import pi

import numpy as np

from ftqp.model.robot import Robot

TABLE = (
    (0.0, 0.6, 0.0, pi / 2),
    (pi / 2, 0.5, 0.0, -pi / 2),
    (0.0, 0.5, 5.0, 0.0),
    (0.0, 0.5, 5.0, 0.0),
    (0.0, 0.5, 0.0, pi / 2),
    (-pi / 2, 0.5, 0.0, -pi / 2),
    (0.0, 0.6, 0.0, 0.0),
)
"""Standard Denavit-Hartenberg rows (theta, d, a, alpha) [rad, m, m, rad]."""

START = (-50.0, -70.0, 50.0, -60.0, 30.0, 70.0, 0.0)
"""Start of the example [deg]."""


def zhang7() -> Robot:
    """Arm of 7 joints with two booms of 5 m, without gravity; kinematics only.

    Source: Zhang et al. 2016, table 1 and example: link figures, start, +-150 deg. The
    table's header says modified Denavit-Hartenberg; read so, joints 6 and 7 would be coaxial, so it is read
    as standard. Chosen here: 1 rad/s, acceleration ``v_max / RISE_TIME``.
    """
    bend = np.deg2rad(150.0)
    return Robot.from_dh(
        TABLE,
        name="zhang7",
        limits={"q_min": -bend, "q_max": bend, "v_max": 1.0},
        neutral=np.deg2rad(START),
        gravity=(0.0, 0.0, 0.0),
    )
