"""The torques by which the servos of a real arm follow positions, velocities or torques."""

from typing import ClassVar, final

import numpy as np

from ftqp.core.checks import FloatArray, positive
from ftqp.core.errors import InputError, unknown
from ftqp.core.setting import Setting, Settings
from ftqp.kernel.entry.session import ArmSession, Memory
from ftqp.model.robot import Robot
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

    A joint that does not obey is no reason to throw the others about, so that they are asked nothing for the
    sake of a joint whose motor is off or that ``strays`` names, and for motors S at their limits M is
    multiplied by the acceleration that the limit leaves: M_SS a_S = tau_S - h_S - M_SF a_F.

    Args:
        robot: the arm as its maker knows it.
        drive: ``"position"``, ``"velocity"`` or ``"torque"``, what the arm takes.
        bandwidth: of the joint servos, wn, > 0 [rad/s]; stiffer ones follow closer, by shorter time steps.
        takes_velocity: whether a position servo is given velocities, too; without it the arm follows late by
            2/wn.

    Attributes:
        demand: What each servo asks of its motor, whether that gives it or not, within the healthy torque
            limits, (nv,) [N m or N]; belongs to the servos.
        strays: 1.0 for a joint that does not obey though its motor is on, else 0.0, (nv,); it may be written.

    Source: Luh, Walker and Paul 1980, the computed torque, with a double pole at wn.
    """

    settings: ClassVar[Settings] = {
        "bandwidth": Setting(unit="rad/s", above=0.0),
        "takes_velocity": Setting(),
    }

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
        wn = positive("bandwidth of the servo", bandwidth, "rad/s")
        n = robot.nv
        self._arm, self._memory = ArmSession(robot.chain.constants()), Memory("servo")
        self._ask = self._arm.servos(self._memory)
        S, kinematics = self._memory.fields, self._arm.K.kinematics
        S.stiffness, S.damping = (wn * wn, 2.0 * wn) if drive == "position" else (0.0, wn)
        S.tau_max[:n] = robot.limits.tau_max
        self._takes_velocity = takes_velocity
        self._mass, self._bias = kinematics.M[:n, :n], kinematics.h[:n]
        self._q, self._v, self._tau = S.q[:n], S.v[:n], S.tau[:n]
        self._a, self._tau_max = S.a[:n], S.tau_max[:n]
        self.demand: FloatArray = S.demand[:n]
        self.strays: FloatArray = S.unresponsive[:n]
        self._sent = np.zeros(n)

    def reset(self, q: FloatArray) -> None:
        """Begin at rest, asking for nothing yet.

        Args:
            q: True joint positions, (nv,) [rad or m].
        """
        self.demand[:] = 0.0

    def take(self, command: Command) -> None:
        """Hold the command from now on.

        Args:
            command: the planner's step for this tick.
        """
        if self.drive == "torque":
            self._sent[:] = command.tau
            np.clip(self._sent, -self._tau_max, self._tau_max, out=self.demand)
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
            np.clip(self._sent, -limit, limit, out=tau)
            return
        full = self._ask(q, v, limit)
        if full < 0:
            raise InputError(
                f"q, v and limit have shapes {np.shape(q)}, {np.shape(v)} and {np.shape(limit)}, expected "
                f"(nv,) = ({len(self._tau)},) numbers each"
            )
        if full:
            self._share_limits(limit)
        tau[:] = self._tau

    def _share_limits(self, limit: FloatArray) -> None:
        """Put motors beyond their limits there, the farthest first, and the torques to what that leaves."""
        M, h, tau, obeys = self._mass, self._bias, self._tau, (limit > 0.0) & (self.strays == 0.0)
        wanted = np.where(obeys, 0.0, np.diag(M) * self._a)
        a, on = np.where(obeys, self._a, 0.0), np.where(obeys, limit, np.inf)
        np.add(M @ a, h, out=tau)
        full: list[int] = []
        at: list[float] = []
        for _ in range(len(tau)):
            beyond = np.abs(tau) / on
            beyond[full] = 0.0
            worst = int(np.argmax(beyond))
            if beyond[worst] <= 1.0:
                break
            full.append(worst)
            at.append(float(np.copysign(limit[worst], tau[worst])))
            a[full] += np.linalg.solve(M[np.ix_(full, full)], np.array(at) - tau[full])
            np.add(M @ a, h, out=tau)
        tau += wanted
        np.clip(tau, -limit, limit, out=tau)
