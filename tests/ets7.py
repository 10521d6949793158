"""ETS-VII, the satellite of 1997 whose arm flew free of any base: six joints on a body of 2.5 t.

Source: models/model_ETS7.m of D. Dimitrov's toolbox bMSd, https://github.com/drdv/bmsd, after Yoshida and
Abiko 2002, which itself was not at hand; its three wheels of 1 kg are left out. Ranges and speeds are
choices: a test needs some.
"""

from math import pi

import numpy as np
import pinocchio as pin

import ftqp
from ftqp.model.serial import Inertial, symmetric

BASE = Inertial(mass=2552.0, com=np.zeros(3), inertia=symmetric(6206.0, 48.16, 78.52, 3541.0, -29.22, 7087.0))
LINKS = (  # turn of the joint's frame, its place from the last com, com from it, mass, inertia
    ((0, 0, 0), (-0.785, -0.295, 1), (0, 0, 0.175), 35.01, (1.218, -0.07309, 0.00071, 0.5132, 0.1132, 1.692)),
    ((-pi / 2, 0, -pi / 2), (0, 0.275, 0.175), (0.435, 0, 0), 22.45, (0.102, 0, -0.00214, 3.378, 0, 3.752)),
    ((0, 0, pi / 2), (0.435, 0, 0), (0.315, 0, 0.275), 21.89, (0.4327, 0, -0.6328, 2.266, 0, 2.528)),
    ((0, 0, -pi / 2), (0.315, 0, 0), (0, 0, -0.1335), 16.54, (0.3878, 0, 0.01675, 0.3963, 0, 0.07271)),
    ((pi / 2, pi / 2, 0), (0, 0, -0.1335), (0, 0, 0.1385), 26.0, (0.5727, 0, -0.2313, 0.5987, 0, 0.129)),
    ((pi, pi / 2, 0), (0, 0, 0.1385), (0, 0, 0.266), 18.49,
     (0.165, 0.000781, -0.0145, 0.241, -0.000137, 0.259)),
)  # fmt: skip
HAND = (0.0, 0.266, 0.0)
"""The hand, from the centre of mass of the last link."""


def turned(x: float, y: float, z: float) -> np.ndarray:
    """Rx(x) Ry(y) Rz(z)."""
    return pin.utils.rotate("x", x) @ pin.utils.rotate("y", y) @ pin.utils.rotate("z", z)


def ets7() -> ftqp.Robot:
    """The arm on the floating body, 12 joints, at rest in space."""
    model, parent, last = pin.Model(), 0, np.zeros(3)
    model.name = "ets7"
    model.gravity = pin.Motion.Zero()
    for k, (turn, place, com, mass, inertia) in enumerate(LINKS):
        where = pin.SE3(turned(*turn), last + np.array(place, dtype=float))
        parent = model.addJoint(parent, pin.JointModelRZ(), where, f"joint{k + 1}", np.full(1, 1e3),
                                np.full(1, 0.2), np.full(1, -pi), np.full(1, pi))  # fmt: skip
        model.addJointFrame(parent)
        last = np.array(com, dtype=float)
        model.appendBodyToJoint(parent, pin.Inertia(mass, last, symmetric(*inertia)), pin.SE3.Identity())
    model.addFrame(pin.Frame("hand", parent, pin.SE3(np.eye(3), last + HAND), pin.FrameType.OP_FRAME))
    arm = ftqp.Robot.from_pinocchio(model, "hand", acceleration=0.2)
    return arm.on_free_base(BASE)
