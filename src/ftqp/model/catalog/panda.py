"""Franka Emika Panda."""

from math import pi

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.model.capsules import Capsule
from ftqp.model.catalog.arm import arm, links
from ftqp.model.robot import Robot
from ftqp.model.serial import Inertial, placement, symmetric

ORIGINS = (
    ((0.0, 0.0, 0.333), (0.0, 0.0, 0.0)),
    ((0.0, 0.0, 0.0), (-pi / 2, 0.0, 0.0)),
    ((0.0, -0.316, 0.0), (pi / 2, 0.0, 0.0)),
    ((0.0825, 0.0, 0.0), (pi / 2, 0.0, 0.0)),
    ((-0.0825, 0.384, 0.0), (-pi / 2, 0.0, 0.0)),
    ((0.0, 0.0, 0.0), (pi / 2, 0.0, 0.0)),
    ((0.088, 0.0, 0.0), (pi / 2, 0.0, 0.0)),
)
"""Joint origins, xyz [m] and roll, pitch, yaw [rad] in the previous joint's frame."""

INERTIALS = (
    (4.970684, (0.003875, 0.002081, -0.04762), (0.70337, -0.000139, 0.006772, 0.70661, 0.019169, 0.009117)),
    (0.646926, (-0.003141, -0.02872, 0.003495), (0.007962, -0.003925, 0.010254, 0.02811, 0.000704, 0.025995)),
    (
        3.228604,
        (0.027518, 0.039252, -0.066502),
        (0.037242, -0.004761, -0.011396, 0.036155, -0.012805, 0.01083),
    ),
    (3.587895, (-0.05317, 0.104419, 0.027454), (0.025853, 0.007796, -0.001332, 0.019552, 0.008641, 0.028323)),
    (
        1.225946,
        (-0.011953, 0.041065, -0.038437),
        (0.035549, -0.002117, -0.004037, 0.029474, 0.000229, 0.008627),
    ),
    (
        1.666555,
        (0.060149, -0.014117, -0.010517),
        (0.001964, 0.000109, -0.001158, 0.004354, 0.000341, 0.005433),
    ),
    (
        0.735522,
        (0.010517, -0.004252, 0.061597),
        (0.012516, -0.000428, -0.001196, 0.010027, -0.000741, 0.004815),
    ),
)
"""Mass [kg], centre of mass [m] and inertia about it xx, xy, xz, yy, yz, zz [kg m2] of links 1 to 7."""

CAPSULES = (
    ("panda_link0", "universe", (-0.0001, 0.0, 0.0514), (-0.0567, -0.0001, 0.0151), 0.1045),
    ("panda_link1", "panda_joint1", (0.0, -0.0534, 0.0008), (0.0, -0.0002, -0.1397), 0.0762),
    ("panda_link2", "panda_joint2", (-0.0001, -0.1418, 0.0), (-0.0001, 0.0015, 0.0535), 0.0762),
    ("panda_link3", "panda_joint3", (0.0829, 0.0426, 0.0004), (0.0027, 0.0007, -0.0832), 0.0693),
    ("panda_link4", "panda_joint4", (0.0, 0.0, 0.0424), (-0.0814, 0.0836, 0.0006), 0.0695),
    ("panda_link5", "panda_joint5", (0.0, 0.0639, 0.0028), (0.0, 0.0103, -0.2435), 0.0674),
    ("panda_link6", "panda_joint6", (0.0231, 0.0068, 0.006), (0.087, 0.0087, -0.0004), 0.0751),
    ("panda_link7", "panda_joint7", (-0.0051, -0.0051, 0.0733), (0.0329, 0.033, 0.0808), 0.0494),
)
"""Links 0 to 7 as capsules: name, joint, both ends in the joint's frame [m], radius [m]."""
HAND_CAPSULE = ((-0.0001, -0.0758, 0.0212), (-0.0002, 0.06, 0.0314), 0.0494)
"""The hand in its own frame, ..."""
FINGER_CAPSULES = (
    ((0.0001, -0.009, 0.0402), (0.0, -0.0129, 0.0038), 0.0178),
    ((0.0, 0.009, 0.0402), (0.0, 0.0129, 0.0038), 0.0178),
)
"""... and its closed fingers in theirs."""

HAND = Inertial(mass=0.73, com=np.array([-0.01, 0.0, 0.03]), inertia=np.diag([0.001, 0.0025, 0.0017]))
FINGER = Inertial(mass=0.015, com=np.zeros(3), inertia=np.diag([2.375e-6, 2.375e-6, 7.5e-7]))

FLANGE = placement((0.0, 0.0, 0.107))
HAND_IN_FLANGE = placement((0.0, 0.0, 0.0), (0.0, 0.0, -pi / 4))
FINGERS_IN_HAND = placement((0.0, 0.0, 0.0584))
TCP_IN_HAND = placement((0.0, 0.0, 0.1034))


def panda(*, hand: bool = True) -> Robot:
    """Franka Emika Panda (FER): 7 joints, masses, and its hand with closed fingers.

    The tip is ``panda_hand_tcp``, between the finger tips; without the hand it is the flange ``panda_link8``.

    Source: kinematics and limits of position, velocity, acceleration and torque: Franka Control Interface
    documentation, "Robot and interface specifications", Denavit-Hartenberg parameters (modified, written here
    as the URDF of franka_ros writes them) and limits of the Panda. Masses: C. Gaz, M. Cognetti, A. Oliva, P.
    Robuffo Giordano, A. De Luca, "Dynamic identification of the Franka Emika Panda robot with retrieval of
    feasible parameters using penalty-based optimization", IEEE RA-L 4(4), 2019. Hand and fingers:
    franka_description (the maker's figures). The limit of joint 4 leaves zero out: the arm cannot stretch. No
    rotor inertia is published; none is counted. Capsules: fitted to the hulls of franka_description's
    collision meshes, as ``Robot.from_urdf`` does (1.4 to 2.4 times their volumes).
    """
    limits = dict(
        q_min=[-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973],
        q_max=[2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973],
        v_max=[2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61],
        a_max=[15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0],
        tau_max=[87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0],
    )
    inertials = [
        Inertial(mass=m, com=np.array(c), inertia=symmetric(*moments)) for m, c, moments in INERTIALS
    ]
    mount = FLANGE @ HAND_IN_FLANGE
    fingers = mount @ FINGERS_IN_HAND
    return arm(
        "panda",
        [f"panda_joint{i + 1}" for i in range(7)],
        [placement(*origin) for origin in ORIGINS],
        inertials,
        limits,
        tip="panda_hand_tcp" if hand else "panda_link8",
        tip_pose=mount @ TCP_IN_HAND if hand else FLANGE,
        payload=[(mount, HAND), (fingers, FINGER), (fingers, FINGER)] if hand else [],
        neutral=[0.0, -pi / 4, 0.0, -3 * pi / 4, 0.0, pi / 2, pi / 4],
        capsules=[*links(CAPSULES), *(_hand_capsules(mount, fingers) if hand else ())],
    )


def _hand_capsules(mount: FloatArray, fingers: FloatArray) -> list[Capsule]:
    """Hand and fingers in the frame of the last joint."""
    made = [("panda_hand", mount, HAND_CAPSULE)]
    names = ("panda_leftfinger", "panda_rightfinger")
    made += [(name, fingers, ends) for name, ends in zip(names, FINGER_CAPSULES, strict=True)]
    placed = []
    for name, T, (first, second, radius) in made:
        a, b = (T[:3, :3] @ end + T[:3, 3] for end in (first, second))
        placed.append(Capsule(a, b, radius, frame="panda_joint7", name=name))
    return placed
