"""Two Franka Emika Pandas on one base."""

import numpy as np
import pinocchio as pin

from ftqp.core.checks import positive
from ftqp.model.capsules import Capsule
from ftqp.model.catalog.panda import panda
from ftqp.model.grafting import graft
from ftqp.model.limits import joined
from ftqp.model.robot import Robot
from ftqp.model.serial import placement

SIDES = (("left", 0.5), ("right", -0.5))
"""The arms, and where each stands along y, in their distance."""


def dual_panda(*, apart: float = 0.6) -> Robot:
    """Two Pandas beside each other on one base, facing the same way: 14 joints, masses and both hands.

    Joints are ``left_joint1`` to ``left_joint7`` and ``right_joint1`` to ``right_joint7``, the tips
    ``left_hand`` and ``right_hand`` between the finger tips. The arms stand at y = ``apart`` / 2 and
    -``apart`` / 2, and at neutral their hands are as far from each other.

    Kinematics, limits and masses are those of ``panda``, which names their sources.

    Args:
        apart: Distance of the two arms, > 0 [m].
    """
    one, distance = panda(), positive("apart", apart, "m")
    model = pin.Model()
    model.name, model.gravity = "dual_panda", one.model.gravity
    for side, share in SIDES:
        names = {name: name.replace("panda", side) for name in one.joints} | {one.tip: f"{side}_hand"}
        graft(model, 0, placement((0.0, share * distance, 0.0)), one.model, names)
    found = Robot.from_pinocchio(
        model,
        tips=[f"{side}_hand" for side, _ in SIDES],
        limits=joined(one.limits, one.limits),
        neutral=np.tile(one.neutral, 2),
        length=one.length,
    )
    bodies = [_beside(body, side, share * distance) for side, share in SIDES for body in one.capsules]
    return found.with_capsules(bodies)


def _beside(body: Capsule, side: str, y: float) -> Capsule:
    """A link of one of the arms; what does not move stands where the arm does."""
    name, frame = (word.replace("panda", side) for word in (body.label, body.frame or "universe"))
    away = np.array([0.0, y if frame == "universe" else 0.0, 0.0])
    return Capsule(body.a + away, body.b + away, body.radius, frame=frame, name=name)
