"""The hyper-redundant arm of Bedrossian."""

from math import pi

import numpy as np

from ftqp.model.catalog.arm import arm
from ftqp.model.robot import Robot
from ftqp.model.serial import placement

INCH = 0.0254
SEGMENT = 30.0 * INCH
"""Length of each of the six segments base, J2, J4, J6, J8, J10, tip [m]."""

START = (45.0, -60.0, 0.0, -45.0, 0.0, 45.0, 90.0, 45.0, 0.0, 0.0, 0.0)
"""Start of the first manoeuvre [deg]."""


def modular11() -> Robot:
    """Arm of 11 joints, straight up at zero: odd ones roll about z, even ones pitch about -y, no masses.

    Source: Bedrossian 1993: joint order, start and the rate limit of 50 deg/s. Segment lengths (30 in each,
    15 ft in all) and the sign of the pitch axes are not published; they were chosen because they match the
    figures of its manoeuvres. No position limits. Characteristic length 30 in; acceleration
    ``v_max / RISE_TIME``.
    """
    up, pitch, back = (0.0, 0.0, SEGMENT), (pi / 2, 0.0, 0.0), (-pi / 2, 0.0, 0.0)
    steps = [placement((0.0, 0.0, 0.0))]
    for _ in range(5):
        steps += [placement(up, pitch), placement((0.0, 0.0, 0.0), back)]
    return arm(
        "modular11",
        [f"j{i + 1}" for i in range(11)],
        steps,
        None,
        dict(v_max=np.deg2rad(50.0)),
        tip="tip",
        tip_pose=placement(up),
        neutral=np.deg2rad(START),
        length=SEGMENT,
    )
