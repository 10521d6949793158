"""Tip pose and joint-space dynamics of the simulated arm, by the kernel's formulas in a record of its own."""

from typing import final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.session import ArmSession
from ftqp.model.robot import Robot


@final
class Arm:
    """The kernel's kinematics and dynamics of one robot, apart from any planner."""

    def __init__(self, robot: Robot) -> None:
        n = robot.nv
        self._session = ArmSession(robot.chain.constants())
        kinematics = self._session.K.kinematics
        self._tip = np.eye(4)
        self._rotation = kinematics.R_tip.reshape(3, 3)
        self._origin = kinematics.o_tip
        self._mass, self._bias = kinematics.M[:n, :n], kinematics.h[:n]

    def tip(self, q: FloatArray) -> FloatArray:
        """Pose of E in W, (4, 4); valid until the next call."""
        self._session.kinematics(q)
        self._tip[:3, :3] = self._rotation
        self._tip[:3, 3] = self._origin
        return self._tip

    def dynamics(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """M (nv, nv) and h (nv,) with tau = M a + h; valid until the next call."""
        self._session.dynamics(q, v)
        return self._mass, self._bias
