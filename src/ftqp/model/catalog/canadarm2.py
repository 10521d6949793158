"""Canadarm2, the arm of the International Space Station."""

from dataclasses import replace
from math import pi

import numpy as np

from ftqp.model.audit import note
from ftqp.model.catalog.arm import arm
from ftqp.model.robot import Robot
from ftqp.model.serial import placement

END = 1.3589
"""From the end of either hand to its roll joint, along the roll's axis [m]."""
ROLL_TO_YAW = 0.7026
"""Distance of a yaw joint from the roll joint beside it, along the yaw's axis [m]."""
YAW_TO_PITCH = 0.5692
"""Distance of a pitch joint from the yaw joint beside it, along the pitch's axis [m]."""
BOOM = 7.11
"""Length of each of the two booms [m]."""
ELBOW = 0.475
"""Offset of the booms from each other at the elbow, along its axis [m]."""

X, Y, Z = (0.0, pi / 2, 0.0), (-pi / 2, 0.0, 0.0), (0.0, 0.0, 0.0)
"""Roll, pitch, yaw [rad] that turn the z axis, about which a joint turns, into x, y or z of the arm."""

JOINTS = (
    ("shoulder_roll", X, (END, 0.0, 0.0)),
    ("shoulder_yaw", Z, (0.0, 0.0, ROLL_TO_YAW)),
    ("shoulder_pitch", Y, (0.0, -YAW_TO_PITCH, 0.0)),
    ("elbow_pitch", Y, (BOOM, -ELBOW, 0.0)),
    ("wrist_pitch", Y, (BOOM, 0.0, 0.0)),
    ("wrist_yaw", Z, (0.0, -YAW_TO_PITCH, 0.0)),
    ("wrist_roll", X, (0.0, 0.0, -ROLL_TO_YAW)),
)
"""Name, axis, and place after the joint before it, in axes of the arm stretched along x at q = 0 [m]."""

START = (15.0, 55.0, -15.0, 45.0, -55.0, 40.0, -30.0)
"""A posture from which the hand moves and turns in every direction without any one of the joints [deg]."""

SPEED_UP = 4.0
"""Seconds from rest to full speed; nobody publishes an acceleration, so this is a choice."""

LEFT_OUT = (
    "a_max = v_max / 4 s is a choice, for no acceleration of Canadarm2 is published; give acceleration=... "
    "to replace it",
    "no masses: those published (1.5 t in all) come without centres of mass in what could be read, so no "
    "torque is computed",
)
"""What of the arm could not be sourced."""


def canadarm2() -> Robot:
    """Canadarm2 (SSRMS), 7 joints and 17 m, without gravity; kinematics only, tip at the end of its hand.

    Roll, yaw and pitch at the shoulder, a pitch at the elbow, pitch, yaw and roll at the wrist. The base
    stands: the station's 420 t against the arm's 1.5 t. Booms that bend, gears with play and the brakes'
    slip are left out.

    Source: Nguyen and Hughes 1994 for distances, 270 deg to either side and 4 deg/s of every joint, entered
    anew; as the chapter itself was not at hand, they were taken from two descriptions that cite it and agree
    in ranges and speeds (TraceableRobotModels, whose distances these are, and Space ROS). The length and the
    ranges are those that MDA, its maker, publishes: 17 m, 270 deg. The findings say what nobody could be
    asked for. Start: a choice.
    """
    steps, lean = [], np.eye(4)
    for _, axis, place in JOINTS:
        turn = placement((0.0, 0.0, 0.0), axis)
        steps.append(np.linalg.inv(lean) @ placement(place) @ turn)
        lean = turn
    bend, speed = np.deg2rad(270.0), np.deg2rad(4.0)
    robot = arm(
        "canadarm2",
        [name for name, _, _ in JOINTS],
        steps,
        None,
        dict(q_min=-bend, q_max=bend, v_max=speed, a_max=speed / SPEED_UP),
        tip="hand",
        tip_pose=np.linalg.inv(lean) @ placement((END, 0.0, 0.0)),
        neutral=np.deg2rad(START),
        gravity=(0.0, 0.0, 0.0),
    )
    return replace(robot, findings=(*robot.findings, *map(note, LEFT_OUT)))
