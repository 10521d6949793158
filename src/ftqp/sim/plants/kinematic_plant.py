"""The arm that is commanded: what really happens to each joint between two ticks."""

import logging
from dataclasses import dataclass
from typing import final

import numpy as np

from ftqp.core.checks import FloatArray, array, instance, non_negative, positive, seen
from ftqp.core.errors import InputError, unknown
from ftqp.faults.kinds import Degraded, Fault, FreeSwinging, Locked, not_served
from ftqp.model.followers import led_joints
from ftqp.model.robot import Robot
from ftqp.sim.plants.plant import Arm, Command, Plant

_LOG = logging.getLogger("ftqp")
LEVELS = ("acceleration", "velocity")
BRAKE_SHARE = 0.25
"""How hard the brake of a joint holds back when it closes, as a share of the joint's acceleration limit.

It is a property of the simulated brake, which a fault's own ``deceleration`` replaces. A planner that assumes
another deceleration of the same fault is wrong about this arm.
"""
AGREEMENT = 1e-9
"""A failed joint follows its command bit by bit when that is so near to what it truly does [rad/s or m/s]."""


@dataclass(frozen=True, slots=True)
class StopImpact:
    """A free-swinging joint has met its end stop."""

    joint: str  # Its name
    time: float  # When, since the plant was reset [s]
    speed: float  # How fast it was [rad/s or m/s]


@final
class KinematicPlant(Plant):
    """The arm that does what the command says, except for its failed joints.

    Healthy joints take over ``command.q`` and ``command.v``, which the planner has integrated with its
    command held for dt: q + dt v + dt^2 a/2 and v + dt a, at the velocity level q + dt v. A failed joint does
    what its fault says:

    * locked, ramp: brakes at the deceleration of the fault, or of the brake where the fault names none, and
      harder, up to its acceleration limit, where it would run out of its range; the last step is partial,
      then q is bitwise fixed.
    * locked, instant: v = 0 at once. With the resets ``momentum`` and ``task`` the joint keeps its velocity
      until the command of that tick has been given: the planner derives the jump of the others from it.
    * free-swinging: its torque is that of friction at the velocity after the step, as in the planner's row:
      (M_FF + dt D) a_F = -(M_FH a_H + h_F) - D v_F with the damping D, that of the fault and the joint's own;
      Coulomb friction then takes what it can of that velocity. An end stop takes all of it, and the healthy
      joints do not feel the impact.
    * degraded: its velocity and acceleration saturate at what is left of the limits, and it stops at the ends
      of what is left of its range. What is left of its torque does not matter here: this arm has no motors.

    A joint that follows another one is where its leader puts it, and fails with it.

    Where a command agrees with that to 1e-9, it is followed bit by bit, so an arm whose failure was reported
    at once moves exactly as commanded.

    Args:
        robot: the arm.
        dt: sampling period [s].
        level: ``"acceleration"`` or ``"velocity"``, as of the planner.
        stop_distance: how far beyond its range a free-swinging joint meets its end stops, >= 0 [rad or m];
            the planner expects them at the range.
        brake: deceleration of a closing brake as a share of the joint's acceleration limit, > 0; with more
            the joint stops sooner. A fault with a deceleration of its own has that one.
    """

    __slots__ = (
        "_arm", "_brake", "_dt", "_faults", "_holds_acceleration", "_impacts", "_led", "_q", "_robot",
        "_stops", "_ticks", "_v",
    )  # fmt: skip

    def __init__(
        self,
        robot: Robot,
        dt: float,
        level: str = "acceleration",
        *,
        brake: float = BRAKE_SHARE,
        stop_distance: float = 0.0,
    ) -> None:
        if level not in LEVELS:
            raise unknown("level", level, "a plant", LEVELS)
        instance("robot", robot, Robot, "an ftqp.Robot, for example planner.robot")
        self._robot = robot
        self._arm = Arm(robot)
        self._dt = positive("dt", dt, "s")
        self._brake = positive("brake", brake) * robot.limits.a_max
        distance = non_negative("stop_distance", stop_distance, "rad or m")
        self._stops = robot.limits.q_min - distance, robot.limits.q_max + distance
        self._impacts: list[StopImpact] = []
        self._ticks = 0
        self._holds_acceleration = level == "acceleration"
        self._q, self._v = robot.neutral.copy(), np.zeros(robot.nv)
        self._faults: dict[int, Fault] = {}
        self._led = led_joints(robot.chain)

    @property
    def q(self) -> FloatArray:
        return seen(self._q)

    @property
    def v(self) -> FloatArray:
        return seen(self._v)

    @property
    def impacts(self) -> tuple[StopImpact, ...]:
        """The impacts of free-swinging joints on their end stops since the last reset."""
        return tuple(self._impacts)

    @property
    def dt(self) -> float:
        """The period of the commands that it takes [s]."""
        return self._dt

    def reset(self, q: FloatArray, v: FloatArray) -> None:
        self._faults.clear()
        self._impacts.clear()
        self._ticks = 0
        self._q[:] = self._robot.angles(q)
        self._v[:] = array("v", v, (self._robot.nv,), "(nv,)")

    def fail(self, fault: Fault) -> None:
        i = int(self._robot.chain.lead[self._robot.joint(fault.joint)])
        match fault:
            case Locked(mode="instant", reset="kinematic"):
                self._v[i] = 0.0
            case FreeSwinging() if not self._robot.has_inertia:
                raise InputError(
                    f"{self._robot.name} has no inertia, so the motion of free-swinging "
                    f"{self._robot.joints[i]} is unknown; give the model its masses"
                )
            case Locked() | FreeSwinging() | Degraded():
                pass
            case _:
                not_served(fault, "plant 'kinematic'")
        self._faults[i] = fault

    def repair(self, joint: str | int) -> None:
        self._faults.pop(int(self._robot.chain.lead[self._robot.joint(joint)]), None)

    def advance(self, command: Command) -> None:
        self._ticks += 1
        if self._faults:
            self._advance_failed(command)
        else:
            self._q[:] = command.q
            self._v[:] = command.v
        for m, l, ratio, offset in self._led:
            obeys = self._q[l] == command.q[l]  # bit by bit, as the command rounds it
            self._q[m] = command.q[m] if obeys else ratio * self._q[l] + offset
            self._v[m] = ratio * self._v[l]

    def _advance_failed(self, command: Command) -> None:
        """The same of an arm with joints that have failed."""
        after = np.array(command.v)
        for i, fault in self._faults.items():
            match fault:
                case Locked():
                    after[i] = self._braked(i, fault)
                case Degraded():
                    after[i] = self._saturated(i, fault, after[i])
                case FreeSwinging():
                    pass  # together with the others below
                case _:
                    not_served(fault, "plant 'kinematic'")
        free = [i for i, fault in self._faults.items() if isinstance(fault, FreeSwinging)]
        if free:
            after[free] = self._swung(free, after)
        q = np.array(command.q)
        for i, fault in self._faults.items():
            if self._v[i] == 0.0 and after[i] == 0.0:
                q[i] = self._q[i]
            elif (
                abs(after[i] - command.v[i]) <= AGREEMENT
                and abs(self._integrated(i, after[i]) - command.q[i]) <= AGREEMENT
            ):
                after[i] = command.v[i] if after[i] != 0.0 else 0.0
            else:
                q[i] = self._integrated(i, after[i])
            match fault:
                case Locked():
                    q[i] = self._q[i] if fault.mode == "instant" else q[i]
                case Degraded():
                    q[i], after[i] = self._stopped(i, fault, q[i], after[i])
                case FreeSwinging():
                    q[i], after[i] = self._struck(i, q[i], after[i])
                case _:
                    not_served(fault, "plant 'kinematic'")
        self._q[:], self._v[:] = q, after

    def _integrated(self, i: int, after: float) -> float:
        """Position after dt when the velocity of joint i goes to ``after``."""
        mean = 0.5 * (self._v[i] + after) if self._holds_acceleration else after
        return float(self._q[i] + self._dt * mean)

    def _braked(self, i: int, fault: Locked) -> float:
        """v - sign(v) min(rate dt, |v|), with rate = max(asked, min(v^2/(2 room - |v| dt), a_max)).

        The next velocity of a joint whose brake has closed; room is what is left of its healthy range.
        """
        v, limits = float(self._v[i]), self._robot.limits
        rate = self._brake[i] if fault.deceleration is None else fault.deceleration
        room = float(limits.q_max[i] - self._q[i] if v > 0.0 else self._q[i] - limits.q_min[i])
        way = 2.0 * room - abs(v) * self._dt
        needed = v * v / way if way > 0.0 else np.inf
        step = max(rate, min(needed, limits.a_max[i])) * self._dt
        if fault.mode == "instant" or abs(v) <= step:
            return 0.0
        return float(v - np.sign(v) * step)

    def _saturated(self, i: int, fault: Degraded, wanted: float) -> float:
        """The next velocity of a joint with less velocity and acceleration than commanded."""
        v, limits = float(self._v[i]), self._robot.limits
        step = float(fault.acceleration * limits.a_max[i]) * self._dt
        top = max(float(fault.velocity * limits.v_max[i]), abs(v) - step)
        slack = 1e-12 * (1.0 + abs(wanted))
        reached = min(max(wanted, v - step, -top), v + step, top)
        return wanted if abs(reached - wanted) <= slack else reached

    def _stopped(self, i: int, fault: Degraded, q: float, v: float) -> tuple[float, float]:
        """Position and velocity at the ends of the range that is left; a joint outside can only move back."""
        low = -np.inf if fault.q_min is None else min(fault.q_min, float(self._q[i]))
        high = np.inf if fault.q_max is None else max(fault.q_max, float(self._q[i]))
        if q < low:
            return float(low), max(v, 0.0)
        if q > high:
            return float(high), min(v, 0.0)
        return q, v

    def _struck(self, i: int, q: float, v: float) -> tuple[float, float]:
        """Position and velocity of a free-swinging joint between its end stops, which are plastic."""
        low, high = min(self._stops[0][i], self._q[i]), max(self._stops[1][i], self._q[i])
        if low <= q <= high:
            return q, v
        if abs(self._v[i]) > 0.0:
            hit = StopImpact(self._robot.joints[i], self._ticks * self._dt, abs(v))
            self._impacts.append(hit)
            _LOG.info("%s meets its end stop at %.2f rad/s", hit.joint, hit.speed)
        return (low if q < low else high), 0.0

    def _swung(self, free: list[int], after: FloatArray) -> FloatArray:
        """The next velocities of the free-swinging joints, given those of all others."""
        M, h = self._arm.dynamics(self._q, self._v)
        a = (after - self._v) / self._dt
        a[free] = 0.0
        damping = np.array([getattr(self._faults[i], "damping", 0.0) for i in free])
        right = -(M[free] @ a + h[free]) - damping * self._v[free]  # h has the joints' own friction
        left = M[np.ix_(free, free)] + self._dt * np.diag(damping + self._robot.viscous[free])
        swung: FloatArray = self._v[free] + self._dt * np.linalg.solve(left, right)
        coulomb = np.array([getattr(self._faults[i], "friction", 0.0) for i in free])
        coulomb += self._robot.coulomb[free]
        slowed = self._dt * coulomb / np.diag(left)
        return np.sign(swung) * np.maximum(np.abs(swung) - slowed, 0.0) if coulomb.any() else swung
