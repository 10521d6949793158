"""An arm behind joint servos: the velocity commands add up to a set point that the joints follow late."""

from typing import final

import numpy as np

from ftqp.core.checks import FloatArray, array, positive
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Fault, Locked
from ftqp.model.robot import Robot
from ftqp.sim.plants.plant import Command, Plant


@final
class ServoPlant(Plant):
    """q' = clip((q_set - q)/tau, -v_max, v_max) in sub-steps, q_set += dt v of every command.

    Ramp and instant locks both fix the joint where it is.

    Args:
        robot: the arm; its speed limits are those of the servos.
        dt: sampling period [s].
        time_constant: tau [s].
        substeps: Euler steps in a sample, >= 1.

    Source: a fit to the tables of Holt and Desrochers, NASA N94-26281.
    """

    def __init__(self, robot: Robot, dt: float, *, time_constant: float = 0.1, substeps: int = 10) -> None:
        self._robot = robot
        self._dt = positive("dt", dt, "s")
        self._tau = positive("time constant of the servos", time_constant, "s")
        if not isinstance(substeps, int) or substeps < 1:
            raise InputError(f"substeps is {substeps!r}, expected a whole number >= 1")
        if self._dt / substeps >= 2.0 * self._tau:
            raise InputError(
                f"{substeps} substeps of {self._dt / substeps:g} s are unstable with a time constant of "
                f"{self._tau:g} s; take more"
            )
        self._substeps = substeps
        self._q, self._v = robot.neutral.copy(), np.zeros(robot.nv)
        self._set = self._q.copy()
        self._works = np.ones(robot.nv, dtype=np.bool_)

    @property
    def q(self) -> FloatArray:
        """True joint positions, (nv,) [rad or m]; belongs to the plant."""
        return self._q

    @property
    def v(self) -> FloatArray:
        """Joint velocities at the end of the last sub-step, (nv,) [rad/s or m/s]; belongs to the plant."""
        return self._v

    @property
    def setpoint(self) -> FloatArray:
        """Where the servos want the joints, (nv,) [rad or m]; belongs to the plant."""
        return self._set

    @property
    def drive(self) -> None:
        """The servos add up velocities and keep the sum as a position: any planner fits."""
        return None

    @property
    def tolerance(self) -> float:
        """A joint that a brake holds does not move at all."""
        return 0.0

    @property
    def failure(self) -> None:
        """Nothing breaks this simulation."""
        return None

    def reset(self, q: FloatArray, v: FloatArray) -> None:
        """Put the healthy arm at (q, v), each (nv,), its set point there too."""
        self._works[:] = True
        self._q[:] = self._robot.angles(q)
        self._v[:] = array("v", v, (self._robot.nv,), "(nv,)")
        self._set[:] = self._q

    def fail(self, fault: Fault) -> None:
        """From now on the joint of ``fault`` stands.

        Raises:
            InputError: unknown joint, or a kind of fault other than ``Locked``.
        """
        i = self._robot.joint(fault.joint)
        if not isinstance(fault, Locked):
            raise InputError(
                f"plant 'servo' knows locked joints only, but {self._robot.joints[i]} is "
                f"{type(fault).__name__}; take plant 'kinematic'"
            )
        self._works[i] = False
        self._v[i] = 0.0

    def advance(self, command: Command) -> None:
        """Move on by dt.

        Args:
            command: the planner's step for this tick.
        """
        self._set += self._dt * np.where(self._works, command.v, 0.0)
        h, top = self._dt / self._substeps, self._robot.limits.v_max
        for _ in range(self._substeps):
            rate = np.clip((self._set - self._q) / self._tau, -top, top)
            self._v[:] = np.where(self._works, rate, 0.0)
            self._q += h * self._v
