"""A jerk-limited motion of the joints that work to a posture, as far as motors can hold the arm on it."""

from typing import Any, final

import numpy as np

from ftqp.control.planner.planner_view import JointState, PlannerView
from ftqp.control.references.jerk_limit import Motion, State
from ftqp.core.checks import BoolArray, FloatArray
from ftqp.kernel.entry.session import Memory
from ftqp.kernel.layout.thresholds import (
    ACCELERATION_SHARE,
    BANDWIDTH,
    BANDWIDTH_STEPS,
    DEVIATION,
    EXACT,
    LEAST_ACCELERATION,
    RISE_TIME,
    SPEED_DEVIATION,
)
from ftqp.kernel.layout.ways_room import PROOF
from ftqp.model.robot import Robot


@final
class JointMotion:
    """The motion of the joints of a planner to a posture; whoever leads the planner's joints makes it.

    It is planned from the last command, so that position and velocity go on without a jump, within the
    limits that are believed.

    Attributes:
        memory: What the kernel reads of the motion.
        goal: The posture to go to, (nv,) [rad or m].
    """

    def __init__(
        self, view: PlannerView, robot: Robot, dt: float, level: str, rise_time: float = RISE_TIME
    ) -> None:
        self.memory = Memory("joints")
        self._joints: Any = self.memory.fields
        self._bandwidth = bandwidth = min(BANDWIDTH, BANDWIDTH_STEPS / dt)
        self._accelerates = level == "acceleration"
        self._joints.kp = bandwidth**2 if self._accelerates else bandwidth
        self._joints.kv = 2.0 * bandwidth if self._accelerates else 0.0
        self._view, self._robot, self._dt = view, robot, dt
        self._out = tuple(self._joints[name] for name in ("q", "v", "x"))
        self._later: tuple[float, State] | None = None
        self._table: tuple[FloatArray, FloatArray] | None = None
        self._braking: Motion | None = None
        self._working = np.zeros(0, dtype=np.int64)
        self._looked_at, n = b"", robot.nv
        going = Memory("going")
        self._going: Any = going.fields
        self._going.least[:n] = LEAST_ACCELERATION * robot.limits.a_max
        jerk = np.minimum(robot.limits.a_max / rise_time, robot.limits.j_max)
        self._going.jerk[:n] = ACCELERATION_SHARE * jerk
        self._going.heavy = self._going.ticks = -1
        self._begins = view.bind("begins_anew", going.memory)
        self._plan = view.bind_arm("plan_going", going.memory)
        self._write = view.bind("write_going", going.memory, self.memory.memory)
        self._is_left = view.bind("is_left", going.memory)
        self._judge = view.bind("judge_going", going.memory)
        self._look_up = view.bind("look_up", going.memory)
        self.goal: FloatArray = np.zeros(n)

    @property
    def too_heavy(self) -> str | None:
        """The joint whose motor cannot hold the arm farther on the way; None where all can."""
        heavy = int(self._going.heavy)
        return None if heavy < 0 else self._robot.joints[heavy]

    def begins_anew(self) -> bool:
        """Whether something else is believed than a tick ago, or somebody else has led the planner."""
        return bool(self._begins())

    def goes_on(self) -> None:
        """The tick was this motion's."""
        self._going.ticks = self._view.ticks

    def wait_anew(self) -> None:
        """Wait for the arm to come nearer, from now on."""
        self._going.best, self._going.since, self._going.lately = np.inf, 0, 0

    def judged(self, goal: FloatArray, tolerance: float, counts: BoolArray) -> int:
        """Where the arm, as it is measured, stands on its way to a goal, as a ``Going``.

        It is there where the joints that count are as near as the tolerance.
        """
        W, n = self._going, len(goal)
        W.goal[:n], W.counts[:n], W.tolerance = goal, counts, tolerance
        return self._judge()

    def forget(self) -> None:
        """Let the next plan look at motors again."""
        self._looked_at = b""

    @property
    def duration(self) -> float:
        """How long the motion takes from where it was planned [s]."""
        if self._table is not None:
            return (len(self._table[0]) - 1) * self._dt
        if self._braking is not None:
            return self._braking.duration
        return float(self._going.duration)

    def decay(self, off: float) -> float:
        """About how long an error of the command takes to be ``EXACT`` [s]."""
        poles = 1.5 if self._accelerates else 1.0
        return poles * float(np.log(max(off / EXACT, 1.0))) / self._bandwidth

    def way_from(self, q: FloatArray, goal: FloatArray | None = None) -> FloatArray:
        """From joint positions to a goal, (nv,) [rad or m]; for a continuous joint the short way round."""
        way = (self.goal if goal is None else goal) - q
        turns = self._robot.continuous
        return np.where(turns, np.remainder(way + np.pi, 2.0 * np.pi) - np.pi, way)

    def follow(self, table: FloatArray, *, is_free: bool) -> None:
        """Let the motion go through a place at every tick, (ticks, nv) [rad or m], to the last.

        Bodies may come as near as the proof that it ``is_free`` lets them.
        """
        self._joints.spared = 1.0 - PROOF if is_free else 0.0
        self._later, self._braking, self._table = None, None, (table, np.gradient(table, self._dt, axis=0))
        self._working = np.flatnonzero(self._view.working)
        self.goal, self._going.heavy = table[-1].copy(), -1

    def halt(self, *, is_free: bool = True) -> FloatArray:
        """Plan to come to rest from the last command: where, (nv,) [rad or m].

        Beside a joint that has failed and brakes all come to rest at the same time, so that they stay near
        the way that they were on; else each as soon as it can. Where what is around ``is_free`` as before,
        bodies may come as near as on the motion before.
        """
        end: FloatArray = self._view.command.q
        spared = self._joints.spared if is_free else 0.0
        self.plan(goes=False)
        self._joints.spared = spared
        W, at = self._going, self._working
        if len(at) and self._view.brakes:
            q, v, a, a_max, jerk = (W[name][at] for name in ("q", "v", "a", "a_max", "jerk"))
            self._braking = Motion(len(at))
            self._braking.brake(State(q, v, a), a_max, jerk)
        end[self._working] = self._at(self.duration).q
        return end

    def joined(self, table: FloatArray, t: float) -> tuple[FloatArray, int] | None:
        """A motion from where this one is at a time [s] into one from its end, without a rest; None: none.

        It goes into ``table``, (ticks, nv), so far on as this one would take to its rest. The places of every
        tick are returned, from that of the tick before on, and how many of them come before ``table``.
        """
        dt, at, W, n = self._dt, self._working, self._going, self._robot.nv
        if self._table is not None or not len(at):
            return None
        k = int(np.ceil((self.duration - t) / dt))
        if t < dt or not 1 <= k < len(table) - 2:
            return None
        before, here, behind = table[k - 1 : k + 2, at]
        v, a = (behind - before) / (2.0 * dt), (behind - 2.0 * here + before) / dt**2
        motion, start, count = Motion(len(at)), self._at(t), 0
        bounds = [part[:n][at] for part in (W.v_max, W.a_max, W.jerk)]
        for _ in range(2):  # the second time so that it takes whole ticks
            if not motion.plan(start, here, *bounds, goal_v=v, goal_a=a, least=count * dt):
                return None
            count = int(np.ceil(motion.duration / dt - EXACT))
        if count > 2 * k or motion.duration > count * dt + EXACT:
            return None
        rows = np.tile(table[k], (count + 1, 1))
        rows[0, at] = self._at(t - dt).q
        for i in range(count):
            rows[i + 1, at] = motion.at(i * dt).q
        return np.vstack([rows, table[k:]]), len(rows)

    def plan(self, speed: float = 1.0, *, goes: bool = True) -> None:
        """Plan the motion from the last command to the goal, or to where it comes to rest soonest."""
        W, view = self._going, self._view
        self._later = self._table = self._braking = None
        self._joints.spared = 0.0
        self._working = np.flatnonzero(view.working)
        W.goal[: len(self.goal)], W.speed = self.goal, speed
        if goes:
            looked_at, self._looked_at = self._looked_at, view.belief
            W.looks = looked_at != self._looked_at
        self._plan(goes)

    def write(self, t: float, rate: float = 1.0) -> None:
        """Let the kernel read the motion at a time [s] since it was planned, and what it asks until then.

        Its time goes on by ``rate`` times that of the clock.
        """
        if self._table is None and self._braking is None:
            self._going.t = t
            self._write()
            return
        (q, v, x), at, dt = self._out, self._working, self._dt
        now, then = self._at(t), self._at(t + rate * dt)
        q[at], v[at] = now.q, rate * now.v
        x[at] = rate * (then.v - now.v) / dt if self._accelerates else (then.q - now.q) / dt

    def _at(self, t: float) -> State:
        """The motion at a time [s]; the last one of a table is kept, as the next tick asks for it again."""
        if self._braking is not None:
            return self._braking.at(t)
        if self._table is None:
            W, at = self._going, self._working
            W.t = t
            self._look_up()
            return State(W.q_now[at], W.v_now[at], W.a_now[at])
        if self._later is None or self._later[0] != t:
            self._later = t, self._row(t)
        return self._later[1]

    def _row(self, t: float) -> State:
        """What the table has at a time [s]."""
        assert self._table is not None
        q, v = self._table
        k, at = t / self._dt, self._working
        i = min(int(k), len(q) - 2)
        share = min(k - i, 1.0)
        rows = [one[i, at] + share * (one[i + 1, at] - one[i, at]) for one in (q, v)]
        return State(rows[0], rows[1], np.zeros(len(at)))

    @property
    def table(self) -> FloatArray:
        """The places that are followed, (ticks, nv) [rad or m]."""
        assert self._table is not None
        return self._table[0]

    def moves_at(self, t: float) -> bool:
        """Whether the motion that was planned is not over at a time [s]."""
        return t < self.duration

    def off_at(self, t: float) -> float:
        """How far the command is from where the motion is at a time [s] since it was planned [rad or m]."""
        at = self._working
        return float(np.abs(self._view.command.q[at] - self._at(t).q).max(initial=0.0))

    def is_left_at(self, t: float) -> bool:
        """Whether the command is not where the motion is at a time [s] since it was planned."""
        if self._table is None and self._braking is None:
            self._going.t = t
            return bool(self._is_left())
        command: JointState = self._view.command
        now, at = self._at(t), self._working
        far, slow = np.abs(command.q[at] - now.q) > DEVIATION, SPEED_DEVIATION * self._view.limits.v[at]
        return bool((far | (np.abs(command.v[at] - now.v) > slow)).any())
