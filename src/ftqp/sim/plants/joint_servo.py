"""The servos of joints in physics: ones that know the arm's model, and ones with fixed gains."""

from collections import deque
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from ftqp.core.checks import FloatArray, positive
from ftqp.core.errors import InputError, unknown
from ftqp.core.setting import Setting, Settings, refuse_out_of_range, setting
from ftqp.kernel.entry.session import ArmSession, Memory
from ftqp.model.robot import Robot
from ftqp.sim.plants.plant import DRIVES, Arm, Command
from ftqp.sim.plants.true_arm import per_joint

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


INTEGRAL = 0.25
"""Integral gain of velocity servos as a share of bandwidth times gain: without masses a double pole."""
PLAY = 628.0
"""Resonance of a gear that has play and no other elasticity [rad/s], 100 Hz."""
SPRING_DAMPING = 0.05
"""Damping ratio of an elastic gear, as of harmonic drives."""
ROTOR = 0.5
"""Inertia of a rotor behind an elastic gear, as a share of what its joint has at its neutral posture."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Gains:
    """What the servos of an arm are; each joint's entry by name, or one number for all.

    Attributes:
        bandwidth: At the neutral posture, w > 0 [rad/s].
        damping: Damping ratio of position servos there, z > 0.
        weight: Whether the servos make up for the arm's own weight; without it position servos droop.
        takes_velocity: Whether position servos are given velocities, too.
        delay: How late commands come, >= 0 [s], in whole time steps of the physics.
        resonance: Of an elastic gear whose motor stands, > 0 [rad/s]; None is a stiff gear.
        backlash: Play of the gear, >= 0 [rad or m].

    Raises:
        InputError: A number out of its range.
    """

    bandwidth: float | dict[str, float] = setting(94.0, unit="rad/s", above=0.0)
    damping: float | dict[str, float] = setting(1.0, above=0.0)
    weight: bool = setting(True)
    takes_velocity: bool = setting(True)
    delay: float = setting(0.0, unit="s", least=0.0)
    resonance: float | dict[str, float] | None = setting(None, unit="rad/s", above=0.0)
    backlash: float | dict[str, float] = setting(0.0, unit="rad or m", least=0.0)

    def __post_init__(self) -> None:
        refuse_out_of_range(self, " of the servo")


@final
class GainServo:
    """Servos of one arm with fixed gains a joint: other postures, other joints and loads disturb them.

    With m_i = M_ii of the neutral posture, rotors included, the command (q_c, v_c) and the motor's (q, v):

    * position: tau = m w^2 (q_c - q) + 2 z m w (v_c - v); without a commanded velocity v_c = 0
    * velocity: tau = m w (v_c - v + w/4 times its integral)
    * torque: tau = that of the command

    With ``weight`` the torques that hold the arm's own weight are added to the first two. Behind an elastic
    gear the motor is a rotor of its own, of half the inertia m, that pulls the joint by a spring of
    m resonance^2 (damping ratio 0.05), within its play by nothing.

    ``demand`` is what each servo asks of its motor, whether that gives it or not, within the healthy torque
    limits, (nv,) [N m or N]; ``strays`` has no meaning for servos that know of no other joint, (nv,).
    """

    def __init__(self, robot: Robot, drive: str, gains: Gains, step: float) -> None:
        if drive not in DRIVES:
            raise unknown("drive", drive, "an arm", DRIVES)
        self.drive, self._gains, self._h = drive, gains, positive("step", step, "s")
        n, self._arm = robot.nv, Arm(robot)
        mass = np.diag(self._arm.dynamics(robot.neutral, np.zeros(n))[0]).copy()
        w = per_joint("bandwidth", gains.bandwidth, robot)
        z = per_joint("damping", gains.damping, robot)
        if not (w > 0.0).all() or not (z > 0.0).all():
            raise InputError(f"bandwidth is {w} and damping {z}, expected numbers > 0 for every joint")
        self._kp = mass * w * w if drive == "position" else mass * w * w * INTEGRAL
        self._kd = 2.0 * z * mass * w if drive == "position" else mass * w
        self._tau_max = robot.limits.tau_max
        self._zero = np.zeros(n)
        self._late = round(gains.delay / step)
        play = per_joint("backlash", gains.backlash, robot)
        self._gear: Gear | None = None
        if gains.resonance is not None or play.any():
            resonance = per_joint("resonance", PLAY if gains.resonance is None else gains.resonance, robot)
            self._gear = Gear(mass, resonance, play)
        self.demand: FloatArray = np.zeros(n)
        self.strays: FloatArray = np.zeros(n)
        self.reset(robot.neutral)

    def reset(self, q: FloatArray) -> None:
        """Begin at rest at q, (nv,), which is also the command until one comes; integrals hold the weight."""
        self._now, self._queue = 0, deque[tuple[int, FloatArray, FloatArray, FloatArray]]()
        self._q, self._v, self._sent = np.array(q), np.zeros(len(q)), np.zeros(len(q))
        self._wound, self.demand[:] = np.zeros(len(q)), 0.0
        if self.drive == "velocity" and not self._gains.weight:
            self._wound = self._arm.dynamics(q, self._zero)[1] / self._kp
        if self._gear is not None:
            self._gear.reset(q)

    def take(self, command: Command) -> None:
        """Hold the command from now on, or when it comes."""
        if self.drive == "torque":
            sent = self._q, self._zero, command.tau.copy()
        else:
            sent = command.q.copy(), command.v.copy(), self._zero
        self._queue.append((self._now + self._late, *sent))

    def torques(self, q: FloatArray, v: FloatArray, limit: FloatArray, tau: FloatArray) -> None:
        """Put the torques at the joints at the true state into ``tau``."""
        while self._queue and self._queue[0][0] <= self._now:
            _, self._q, sent_v, self._sent = self._queue.popleft()
            self._v = sent_v if self._gains.takes_velocity or self.drive == "velocity" else self._zero
        self._now += 1
        gear = self._gear
        at, rate = (q, v) if gear is None else (gear.q, gear.v)
        if self.drive == "torque":
            asked = self._sent
        else:
            error = self._v - rate
            if self.drive == "velocity":  # a motor at its limit, or off, winds nothing up
                self._wound += self._h * np.where(np.abs(self.demand) < limit, error, 0.0)
                asked = self._kd * error + self._kp * self._wound
            else:
                asked = self._kp * (self._q - at) + self._kd * error
            if self._gains.weight:
                asked = asked + self._arm.dynamics(q, self._zero)[1]
        np.clip(asked, -self._tau_max, self._tau_max, out=self.demand)
        np.clip(self.demand, -limit, limit, out=tau)
        if gear is not None:
            tau[:] = gear.spring_torque(q, v, tau, self._h)


@final
class Gear:
    """Elastic gears with play: rotors that the motors turn, and springs between them and their joints."""

    def __init__(self, mass: FloatArray, resonance: FloatArray, play: FloatArray) -> None:
        self._rotor = ROTOR * mass
        self._k, self._d = mass * resonance**2, 2.0 * SPRING_DAMPING * mass * resonance
        self._half = 0.5 * play
        self.q, self.v = np.zeros(len(mass)), np.zeros(len(mass))

    def reset(self, q: FloatArray) -> None:
        """Begin at rest where the joints are."""
        self.q, self.v = np.array(q), np.zeros(len(q))

    def spring_torque(self, q: FloatArray, v: FloatArray, tau: FloatArray, h: float) -> FloatArray:
        """The torques of the springs after a time step of the rotors under the motors' torques."""
        wound = self.q - q
        beyond = wound - np.clip(wound, -self._half, self._half)
        torque: FloatArray = self._k * beyond + np.where(beyond != 0.0, self._d * (self.v - v), 0.0)
        self.v = self.v + h / self._rotor * (tau - torque)
        self.q = self.q + h * self.v
        return torque
