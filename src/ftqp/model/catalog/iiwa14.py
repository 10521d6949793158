"""KUKA LBR iiwa 14 R820."""

from math import pi

import numpy as np

from ftqp.model.catalog.arm import arm
from ftqp.model.robot import Robot
from ftqp.model.serial import Inertial, placement

ORIGINS = (
    ((0.0, 0.0, 0.1575), (0.0, 0.0, 0.0)),
    ((0.0, 0.0, 0.2025), (pi / 2, 0.0, pi)),
    ((0.0, 0.2045, 0.0), (pi / 2, 0.0, pi)),
    ((0.0, 0.0, 0.2155), (pi / 2, 0.0, 0.0)),
    ((0.0, 0.1845, 0.0), (-pi / 2, pi, 0.0)),
    ((0.0, 0.0, 0.2155), (pi / 2, 0.0, 0.0)),
    ((0.0, 0.081, 0.0), (-pi / 2, pi, 0.0)),
)
"""Joint origins, xyz [m] and roll, pitch, yaw [rad] in the previous joint's frame."""

INERTIALS = (
    (4.0, (0.0, -0.03, 0.12), (0.1, 0.09, 0.02)),
    (4.0, (0.0003, 0.059, 0.042), (0.05, 0.018, 0.044)),
    (3.0, (0.0, 0.03, 0.13), (0.08, 0.075, 0.01)),
    (2.7, (0.0, 0.067, 0.034), (0.03, 0.01, 0.029)),
    (1.7, (0.0001, 0.021, 0.076), (0.02, 0.018, 0.005)),
    (1.8, (0.0, 0.0006, 0.0004), (0.005, 0.0036, 0.0047)),
    (0.3, (0.0, 0.0, 0.02), (0.001, 0.001, 0.001)),
)
"""Mass [kg], centre of mass [m] and principal moments about it [kg m2] of links 1 to 7."""

TIP_IN_LINK7 = (0.0, 0.0, 0.045)


def iiwa14() -> Robot:
    """KUKA LBR iiwa 14 R820: 7 joints, masses, tip at the media flange ``iiwa_link_ee``.

    Source: kinematics, masses: iiwa_description of the iiwa_stack (C. Hennersperger et al., "Towards
    MRI-based autonomous robotic US acquisitions", IEEE TMI 36(2), 2017), whose masses are rounded estimates.
    Limits of position, velocity and torque: KUKA data sheet "LBR iiwa 14 R820", axis data: 170, 120, 170,
    120, 170, 120, 175 deg; 85, 85, 100, 75, 130, 135, 135 deg/s; 320, 320, 176, 176, 110, 40, 40 N m. KUKA
    publishes no acceleration limit: ``v_max / RISE_TIME``. Nor is a rotor inertia published; none is counted.
    """
    limits = dict(
        q_min=-np.deg2rad([170.0, 120.0, 170.0, 120.0, 170.0, 120.0, 175.0]),
        q_max=np.deg2rad([170.0, 120.0, 170.0, 120.0, 170.0, 120.0, 175.0]),
        v_max=np.deg2rad([85.0, 85.0, 100.0, 75.0, 130.0, 135.0, 135.0]),
        tau_max=[320.0, 320.0, 176.0, 176.0, 110.0, 40.0, 40.0],
    )
    return arm(
        "iiwa14",
        [f"iiwa_joint_{i + 1}" for i in range(7)],
        [placement(*origin) for origin in ORIGINS],
        [Inertial(mass=m, com=np.array(c), inertia=np.diag(moments)) for m, c, moments in INERTIALS],
        limits,
        tip="iiwa_link_ee",
        tip_pose=placement(TIP_IN_LINK7),
        neutral=[0.0, pi / 6, 0.0, -pi / 2, 0.0, pi / 3, 0.0],
    )
