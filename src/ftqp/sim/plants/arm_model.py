"""Tip pose and joint-space dynamics of the simulated arm, by the kernel's formulas in a record of its own."""

from typing import Any, final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.kernel.entry import entries as entry
from ftqp.kernel.layout.record import load_chain, record
from ftqp.model.robot import Robot


@final
class Arm:
    """The kernel's kinematics and dynamics of one robot, apart from any planner.

    Args:
        robot: the arm.
    """

    def __init__(self, robot: Robot) -> None:
        n = robot.nv
        self._record: Any = record(1)
        load_chain(self._record, **robot.chain.constants())
        self._address = int(self._record.ctypes.data)
        self._q, self._v = np.zeros(n), np.zeros(n)
        self._tip = np.eye(4)
        self._rotation = self._record["R_tip"][0].reshape(3, 3)
        self._origin = self._record["o_tip"][0]
        self._mass = self._record["M"][0, :n, :n]
        self._bias = self._record["h"][0, :n]

    def tip(self, q: FloatArray) -> FloatArray:
        """Pose of E in W, (4, 4); valid until the next call.

        Args:
            q: (nv,) [rad or m].
        """
        self._q[:] = q
        entry.kinematics(self._address, self._q, self._v)
        self._tip[:3, :3] = self._rotation
        self._tip[:3, 3] = self._origin
        return self._tip

    def dynamics(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """M (nv, nv) and h (nv,) with tau = M a + h; valid until the next call.

        Args:
            q: (nv,) [rad or m].
            v: (nv,) [rad/s or m/s].
        """
        self._q[:], self._v[:] = q, v
        entry.inverse_dynamics(self._address, self._q, self._v)
        return self._mass, self._bias
