"""The torques by which the servos of a real arm follow positions, velocities or torques."""

from typing import final

import numpy as np

from ftqp.core.checks import FloatArray, positive
from ftqp.core.errors import InputError, unknown
from ftqp.model.robot import Robot
from ftqp.sim.plants.arm_model import Arm
from ftqp.sim.plants.plant import DRIVES, Command

BANDWIDTH = 94.0
"""Of the servos of an arm of which nothing else is said [rad/s], 15 Hz."""


@final
class JointServo:
    """Servos of one arm, which compute torques by a model of the arm as its maker knows it.

    With the command (q_c, v_c) held for a tick, the true state (q, v) and the bandwidth wn:

    * position: tau = M (wn^2 (q_c - q) + 2 wn (v_c - v)) + h; without a commanded velocity v_c = 0
    * velocity: tau = M wn (v_c - v) + h
    * torque: tau = that of the command

    M and h are those of the arm's model, so that a load it does not know is a disturbance to the servo. A law
    with M has the same bandwidth in every posture; gains fixed at one posture have not.

    A joint that does not obey is no reason to throw the others about, so that what M is multiplied by is zero
    for a joint whose motor is off, and for motors S at their limits the acceleration that the limit leaves:
    M_SS a_S = tau_S - h_S - M_SF a_F.

    Args:
        robot: the arm as its maker knows it.
        drive: ``"position"``, ``"velocity"`` or ``"torque"``, what the arm takes.
        bandwidth: wn of the servo, > 0 [rad/s]; a stiffer servo follows closer, and needs shorter time steps.
        takes_velocity: whether a position servo is given velocities, too; without it the arm follows late by
            2/wn.

    Source: Luh, Walker and Paul 1980, the computed torque, with a double pole at wn.
    """

    def __init__(
        self,
        robot: Robot,
        drive: str = "position",
        *,
        bandwidth: float = BANDWIDTH,
        takes_velocity: bool = True,
    ) -> None:
        if drive not in DRIVES:
            raise unknown("drive", drive, "an arm", DRIVES)
        if not takes_velocity and drive != "position":
            raise InputError(
                f"takes_velocity = False is for drive 'position', but the drive is {drive!r}; leave it out"
            )
        self.drive = drive
        self._wn = positive("bandwidth of the servo", bandwidth, "rad/s")
        self._takes_velocity = takes_velocity
        self._arm = Arm(robot)
        n = robot.nv
        self._q, self._v, self._tau = np.zeros(n), np.zeros(n), np.zeros(n)
        self._a, self._part = np.zeros(n), np.zeros(n)

    def take(self, command: Command) -> None:
        """Hold the command from now on.

        Args:
            command: the planner's step for this tick.
        """
        if self.drive == "torque":
            self._tau[:] = command.tau
            return
        self._q[:] = command.q
        if self._takes_velocity:
            self._v[:] = command.v

    def torques(self, q: FloatArray, v: FloatArray, limit: FloatArray, tau: FloatArray) -> None:
        """Put the motor torques at the true state into ``tau``.

        Args:
            q: True joint positions, (nv,) [rad or m].
            v: True joint velocities, (nv,) [rad/s or m/s].
            limit: Largest torque of every motor, 0.0 where it is off, (nv,) [N m or N].
            tau: Motor torques, (nv,) [N m or N]; overwritten.
        """
        if self.drive == "torque":
            np.clip(self._tau, -limit, limit, out=tau)
            return
        a, part, wn = self._a, self._part, self._wn
        np.subtract(self._v, v, out=a)
        if self.drive == "position":
            a *= 2.0 * wn
            np.subtract(self._q, q, out=part)
            part *= wn * wn
            a += part
        else:
            a *= wn
        a *= limit > 0.0
        M, h = self._arm.dynamics(q, v)
        np.dot(M, a, out=tau)
        tau += h
        if (np.abs(tau) > limit).any():
            self._share_limits(M, h, limit, tau)
        np.clip(tau, -limit, limit, out=tau)

    def _share_limits(self, M: FloatArray, h: FloatArray, limit: FloatArray, tau: FloatArray) -> None:
        """Put motors beyond their limits there, the farthest first, and ``tau`` to what that leaves."""
        a, on = self._a, np.where(limit > 0.0, limit, np.inf)
        full: list[int] = []
        at: list[float] = []
        for _ in range(len(tau)):
            beyond = np.abs(tau) / on
            beyond[full] = 0.0
            worst = int(np.argmax(beyond))
            if beyond[worst] <= 1.0:
                return
            full.append(worst)
            at.append(float(np.copysign(limit[worst], tau[worst])))
            a[full] += np.linalg.solve(M[np.ix_(full, full)], np.array(at) - tau[full])
            np.dot(M, a, out=tau)
            tau += h
