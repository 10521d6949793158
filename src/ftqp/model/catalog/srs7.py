"""A seven-joint arm with spherical shoulder and wrist."""

from math import pi

import numpy as np

from ftqp.model.catalog.arm import arm
from ftqp.model.robot import Robot
from ftqp.model.serial import placement

OFFSETS = (0.15, 0.19, 0.21, 0.19, 0.21, 0.19, 0.081)
"""Distance along the local z axis before each joint [m]; upper arm and forearm are 0.40 m."""

TOOL = 0.145
"""Distance of the tool point behind joint 7 [m]."""

PITCH = (0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0)
"""Sign of the y axis a joint turns about; 0: it turns about z."""

START = (-15.0, 40.0, 35.0, -95.0, -40.0, 55.0, 0.0)
"""Start of the studies of a moving base [deg]."""


def srs7() -> Robot:
    """Arm of 7 joints about z, y, z, -y, z, y, z: spherical shoulder and wrist; kinematics only.

    Source: none, a made-up arm in the size of a KUKA iiwa or Kinova Gen3, for studies of structure: locking
    its elbow always costs a task direction. Position limits 170, 120, 170, 120, 170, 120, 175 deg, speeds 85,
    85, 100, 75, 130, 135, 135 deg/s (those of the iiwa 14), acceleration ``v_max / RISE_TIME``,
    characteristic length 0.30 m.
    """
    bend = np.deg2rad([170.0, 120.0, 170.0, 120.0, 170.0, 120.0, 175.0])
    steps = []
    lean = np.eye(4)
    for offset, sign in zip(OFFSETS, PITCH, strict=True):
        turn = placement((0.0, 0.0, 0.0), (-sign * pi / 2, 0.0, 0.0))
        steps.append(np.linalg.inv(lean) @ placement((0.0, 0.0, offset)) @ turn)
        lean = turn
    return arm(
        "srs7",
        [f"j{i + 1}" for i in range(7)],
        steps,
        None,
        dict(q_min=-bend, q_max=bend, v_max=np.deg2rad([85.0, 85.0, 100.0, 75.0, 130.0, 135.0, 135.0])),
        tip="tool",
        tip_pose=placement((0.0, 0.0, TOOL)),
        neutral=np.deg2rad(START),
        length=0.30,
    )
