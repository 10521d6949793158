"""Computed torque around the planner's reference, for arms that take torques faster than the planner runs."""

from typing import Any, final

import numpy as np

from ftqp.core.checks import FloatArray, array, positive
from ftqp.core.errors import InputError
from ftqp.kernel.entry.session import ArmSession
from ftqp.model.robot import Robot


@final
class ComputedTorque:
    """tau = M(q) (a_r + w^2 (q_r - q) + 2 w (v_r - v)) + h(q, v), clipped to the torque limits.

    A planner made with ``drive="torque"`` does this by itself, with an observer. This is the law alone, for a
    torque loop of your own that runs faster than the planner: it holds the arm to ``step.reference``.

    Args:
        robot: The arm, with inertia.
        bandwidth: w, > 0 [1/s]. A larger one holds better against loads and passes on more noise; with a
            delay T keep w T below 0.24.

    Raises:
        InputError: The robot has no inertia, or the bandwidth is not positive.
    """

    def __init__(self, robot: Robot, bandwidth: float = 40.0) -> None:
        if not robot.has_inertia:
            raise InputError(
                f"computed torque needs inertia, which {robot.name} has not; give the model its masses"
            )
        self._w = positive("bandwidth", bandwidth, "1/s")
        self._name, self._n = robot.name, robot.nv
        self._tau_max = robot.limits.tau_max
        self._arm = ArmSession(robot.chain.constants())

    def __repr__(self) -> str:
        return f"ComputedTorque({self._name}, bandwidth={self._w:g})"

    def torques(self, reference: Any, q: Any, v: Any) -> FloatArray:
        """Motor torques, (nv,) [N m or N].

        Args:
            reference: ``step.reference``: q, v, a, (nv,) each.
            q: Measured joint positions, (nv,) [rad or m].
            v: Measured or filtered joint velocities, (nv,) [rad/s or m/s].

        Raises:
            InputError: A wrong shape, or a number that is not finite.
        """
        n, w = self._n, self._w
        q, v = array("q", q, (n,), "(nv,)"), array("v", v, (n,), "(nv,)")
        self._arm.dynamics(q, v)
        k = self._arm.K.kinematics
        a = reference.a + w * w * (reference.q - q) + 2.0 * w * (reference.v - v)
        tau: FloatArray = np.clip(k.M[:n, :n] @ a + k.h[:n], -self._tau_max, self._tau_max)
        return tau
