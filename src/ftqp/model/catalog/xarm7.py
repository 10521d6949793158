"""UFACTORY xArm 7."""

from math import pi

import numpy as np

from ftqp.model.catalog.arm import arm, links
from ftqp.model.robot import Robot
from ftqp.model.serial import Inertial, placement, symmetric

ORIGINS = (
    ((0.0, 0.0, 0.267), (0.0, 0.0, 0.0)),
    ((0.0, 0.0, 0.0), (-pi / 2, 0.0, 0.0)),
    ((0.0, -0.293, 0.0), (pi / 2, 0.0, 0.0)),
    ((0.0525, 0.0, 0.0), (pi / 2, 0.0, 0.0)),
    ((0.0775, -0.3425, 0.0), (pi / 2, 0.0, 0.0)),
    ((0.0, 0.0, 0.0), (pi / 2, 0.0, 0.0)),
    ((0.076, 0.097, 0.0), (-pi / 2, 0.0, 0.0)),
)
"""Joint origins, xyz [m] and roll, pitch, yaw [rad] in the previous joint's frame."""

INERTIALS = (
    (
        2.382,
        (-0.0002, 0.02905, -0.01233),
        (0.0056905, -1.579e-5, 5.125e-6, 0.0049566, -0.000873378, 0.003316654),
    ),
    (
        1.869,
        (0.00022, -0.12856, 0.01735),
        (0.0095989, 1.541e-6, 5.56e-6, 0.00382472, -0.00317156, 0.007565669),
    ),
    (
        1.6383,
        (0.0466, -0.02463, -0.00768),
        (0.00310955, 0.00030837, -0.00058453, 0.00264483, 0.000338893, 0.0026624),
    ),
    (
        1.7269,
        (0.07047, -0.11575, 0.012),
        (0.005889, 0.00137112, 0.00088143, 0.00359703, -0.001762155, 0.00543244),
    ),
    (
        1.3203,
        (-0.00032, 0.01604, -0.026),
        (0.00534665, 1.5117e-5, -3.69e-7, 0.0049779, -0.00022132, 0.0013624),
    ),
    (1.325, (0.06469, 0.03278, 0.02141), (0.0014745, -0.000488, 0.0002953, 0.0019037, 0.00014749, 0.0023652)),
    (0.17, (0.0, -0.00677, -0.01098), (9.3e-5, 0.0, 0.0, 5.87e-5, -3.6e-6, 0.000132)),
)
"""Mass [kg], centre of mass [m] and inertia about it xx, xy, xz, yy, yz, zz [kg m2] of links 1 to 7."""


CAPSULES = (
    ("link_base", "universe", (-0.0052, 0.0005, 0.0943), (-0.0141, 0.0034, 0.0218), 0.0804),
    ("link1", "joint1", (-0.0003, 0.0, -0.0537), (0.0, 0.0171, 0.0), 0.0754),
    ("link2", "joint2", (0.0002, -0.1396, 0.0187), (-0.001, -0.0324, 0.0815), 0.0803),
    ("link3", "joint3", (0.0524, -0.0038, 0.0), (0.0055, -0.0009, -0.042), 0.0764),
    ("link4", "joint4", (0.0863, -0.1202, 0.012), (0.0253, -0.0196, 0.0744), 0.0753),
    ("link5", "joint5", (0.0, 0.046, 0.0), (-0.0012, 0.0089, -0.1511), 0.056),
    ("link6", "joint6", (0.076, 0.0206, 0.0), (0.0184, 0.0056, 0.0179), 0.0611),
    ("link7", "joint7", (0.0, 0.0, -0.014), (-0.0013, -0.0127, -0.0144), 0.04),
)
"""Links as capsules: name, joint, both ends in the joint's frame [m], radius [m]."""

ROTORS = 0.1
"""Rotor inertia seen at every joint [kg m2], stated, not published by the maker; see ``xarm7``."""


def xarm7(*, rotors: bool = True) -> Robot:
    """UFACTORY xArm 7: 7 joints, masses, tip at the flange ``link7``.

    Source: xarm_description of UFACTORY's xarm_ros (kinematics, masses, limits of position, velocity and
    torque); its right angles, rounded there to 1.5708 rad, are exact here. Acceleration: xArm user manual,
    1145 deg/s2 (20 rad/s2) for every joint.

    Rotor inertia: UFACTORY publishes none. 0.1 kg m2 at every joint is what the xArm 7 of MuJoCo Menagerie
    has (google-deepmind/mujoco_menagerie, ufactory_xarm7/xarm7.xml, ``armature``), a choice for simulation,
    not an identification; a rotor of 1e-5 kg m2 behind a gear of 100 makes the same. Without it joint 7 has
    1.4e-4 kg m2, and under torque control a friction of 0.5 N m makes such a wrist lag or hunt. That model's
    friction (1 N m, 2 to 10 N m s/rad), as little identified, is left out.

    Capsules: fitted to the hulls of xarm_description's meshes, as ``Robot.from_urdf`` does (1.6 to 2.5 times
    their volumes).
    """
    turn = 2.0 * pi
    limits = dict(
        q_min=[-turn, -2.059, -turn, -0.19198, -turn, -1.69297, -turn],
        q_max=[turn, 2.0944, turn, 3.927, turn, pi, turn],
        v_max=3.14,
        a_max=20.0,
        tau_max=[50.0, 50.0, 30.0, 30.0, 30.0, 20.0, 20.0],
    )
    return arm(
        "xarm7",
        [f"joint{i + 1}" for i in range(7)],
        [placement(*origin) for origin in ORIGINS],
        [Inertial(mass=m, com=np.array(c), inertia=symmetric(*moments)) for m, c, moments in INERTIALS],
        limits,
        tip="link7",
        tip_pose=np.eye(4),
        neutral=[0.0, -pi / 4, 0.0, pi / 3, 0.0, 7 * pi / 12, 0.0],
        rotors=ROTORS if rotors else 0.0,
        capsules=links(CAPSULES),
    )
