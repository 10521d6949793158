"""A jerk-limited motion of the joints that work to a posture, as far as motors can hold the arm on it."""

from typing import Any, final

import numpy as np

from ftqp.control.inverse_kinematics.motion_validity import HELD
from ftqp.control.planner.planner_view import JointState, PlannerView
from ftqp.control.references.jerk_limit import ENDLESS, RISE_TIME, Motion, State
from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.session import Memory
from ftqp.kernel.layout.thresholds import AT_REST
from ftqp.kernel.layout.ways_room import PROOF
from ftqp.model.robot import Robot

EXACT = 1e-6
"""A command so near to its goal has arrived [m, rad]. A convention."""
BANDWIDTH = 20.0
"""How fast an error to the motion decays, at most [1/s] ..."""
BANDWIDTH_STEPS = 0.2
"""... and times dt, at most: a fifth of it is taken off in a tick, so that the sampled loop does not
overshoot."""

DEVIATION = 0.01
"""A command so far from the motion begins it anew, because limits have held the arm back: by its place [rad
or m] ..."""
SPEED_DEVIATION = 0.05
"""... or by its speed, as a share of v_max."""

SPEED_SHARE, ACCELERATION_SHARE = 0.999, 0.99
"""Shares of the limits that the motion uses: what is left corrects errors at full speed."""
LEAST_ACCELERATION = 0.05
"""Share of a_max that the motion uses even where gravity leaves less, so that it ends."""

PLACES = 17
"""Whether motors hold the arm is looked at in so many places of a motion, ..."""
FINER = 10
"""... and in so many between the last at which they do and the next."""
NEARER_ENDS = 8
"""So many nearer ends are tried before the arm is left where it stands."""


@final
class JointMotion:
    """The motion of the joints of a planner to a posture; whoever leads the planner's joints makes it.

    It is planned from the last command, so that position and velocity go on without a jump, within the
    limits that are believed. ``too_heavy`` names the joint that cannot hold the arm farther on the way.
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
        self._slow: FloatArray = np.zeros(0)
        self._rise_time = rise_time
        self._motion: Motion | None = None
        self._table: tuple[FloatArray, FloatArray] | None = None
        self._bounds: tuple[FloatArray, FloatArray, FloatArray] | None = None
        self._working = np.zeros(0, dtype=np.int64)
        self._looked_at = b""
        self.goal: FloatArray = np.zeros(robot.nv)
        self.too_heavy: str | None = None

    def forget(self) -> None:
        """Let the next plan look at motors again."""
        self._looked_at = b""

    @property
    def duration(self) -> float:
        """How long the motion takes from where it was planned [s]."""
        if self._table is not None:
            return (len(self._table[0]) - 1) * self._dt
        return 0.0 if self._motion is None else self._motion.duration

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
        self._later, self._table = None, (table, np.gradient(table, self._dt, axis=0))
        self._working = np.flatnonzero(self._view.working)
        self.goal, self.too_heavy = table[-1].copy(), None

    def halt(self) -> FloatArray:
        """Plan to come to rest from the last command: where, (nv,) [rad or m]."""
        end: FloatArray = self._view.command.q
        self.plan(goes=False)
        if self._motion is not None:
            end[self._working] = self._motion.at(self._motion.duration).q
        return end

    def joined(self, table: FloatArray, t: float) -> tuple[FloatArray, int] | None:
        """A motion from where this one is at a time [s] into one from its end, without a rest; None: none.

        It goes into ``table``, (ticks, nv), so far on as this one would take to its rest. The places of every
        tick are returned, from that of the tick before on, and how many of them come before ``table``.
        """
        dt, at = self._dt, self._working
        if self._motion is None or self._bounds is None:
            return None
        k = int(np.ceil((self.duration - t) / dt))
        if t < dt or not 1 <= k < len(table) - 2:
            return None
        before, here, behind = table[k - 1 : k + 2, at]
        v, a = (behind - before) / (2.0 * dt), (behind - 2.0 * here + before) / dt**2
        motion, start, count = Motion(len(at)), self._motion.at(t), 0
        for _ in range(2):  # the second time so that it takes whole ticks
            if not motion.plan(start, here, *self._bounds, goal_v=v, goal_a=a, least=count * dt):
                return None
            count = int(np.ceil(motion.duration / dt - EXACT))
        if count > 2 * k or motion.duration > count * dt + EXACT:
            return None
        rows = np.tile(table[k], (count + 1, 1))
        rows[0, at] = self._motion.at(t - dt).q
        for i in range(count):
            rows[i + 1, at] = motion.at(i * dt).q
        return np.vstack([rows, table[k:]]), len(rows)

    def plan(self, speed: float = 1.0, *, goes: bool = True) -> None:
        """Plan the motion from the last command to the goal, or to where it comes to rest soonest."""
        command, limits, robot = self._view.command, self._view.limits, self._robot
        self._later = self._table = None
        self._joints.spared = 0.0
        working = np.flatnonzero(self._view.working)
        if self._motion is None or len(working) != len(self._working):
            self._motion = Motion(len(working)) if len(working) else None
        self._working = working
        self._slow = SPEED_DEVIATION * np.minimum(limits.v[working], ENDLESS)
        if self._motion is None:
            return
        goal = command.q + self.way_from(command.q)
        goal = np.clip(goal, limits.q_min, limits.q_max)[working]
        a_max = ACCELERATION_SHARE * np.maximum(limits.a, LEAST_ACCELERATION * robot.limits.a_max)[working]
        start = State(*(part[working] for part in command))
        if (np.abs(start.v) <= AT_REST * np.minimum(limits.v[working], ENDLESS)).all():
            start = State(start.q, 0.0 * start.v, 0.0 * start.a)  # so that the motion is straight
        v_max = speed * SPEED_SHARE * limits.v[working]
        jerk = np.minimum(robot.limits.a_max / self._rise_time, robot.limits.j_max)[working]
        jerk *= ACCELERATION_SHARE
        self._bounds = v_max, a_max, jerk
        if not goes:
            self._motion.brake(start, a_max, jerk)
            return
        self._motion.plan(start, goal, v_max, a_max, jerk)
        if not self._may_be_too_heavy(limits.tau[working]):
            return
        for _ in range(NEARER_ENDS):
            end = self._last_held(limits.tau[working])
            if end is None:
                return
            self._motion.plan(start, end, v_max, a_max, jerk)
        self._motion.brake(start, a_max, jerk)

    def _may_be_too_heavy(self, tau_max: FloatArray) -> bool:
        """Whether motors may be too weak on the way; no, where they were not and nothing new is believed."""
        looked_at, self._looked_at = self._looked_at, self._view.belief
        if looked_at == self._looked_at and self.too_heavy is None:
            return False
        self.too_heavy = None
        return bool(np.isfinite(tau_max).any())

    def _last_held(self, tau_max: FloatArray) -> FloatArray | None:
        """The last place of the motion up to which motors can hold the arm; None where they can all the way.

        Motors that cannot hold it where the motion begins count as strong enough for what they need there.
        """
        assert self._motion is not None
        at = self._working
        places = np.tile(self._view.command.q, (PLACES, 1))
        for place, t in zip(places, np.linspace(0.0, self._motion.duration, PLACES), strict=True):
            place[at] = self._motion.at(float(t)).q
        share = np.abs(self._view.holding_torques(places)[:, at]) / tau_max
        least = max(HELD, float(share[0].max()))
        beyond = np.flatnonzero(share.max(axis=1) > least)
        if not len(beyond):
            return None
        first = int(beyond[0])
        self.too_heavy = self._robot.joints[int(at[np.argmax(share[first])])]
        between = np.linspace(places[first - 1], places[first], FINER, endpoint=False)
        share = np.abs(self._view.holding_torques(between)[:, at]) / tau_max
        held = np.logical_and.accumulate(share.max(axis=1) <= least)
        last: FloatArray = between[max(0, int(held.sum()) - 1), at]
        return last

    def write(self, t: float, rate: float = 1.0) -> None:
        """Let the kernel read the motion at a time [s] since it was planned, and what it asks until then.

        Its time goes on by ``rate`` times that of the clock.
        """
        if self._motion is None and self._table is None:
            return
        (q, v, x), at, dt = self._out, self._working, self._dt
        now, then = self._at(t), self._at(t + rate * dt)
        q[at], v[at] = now.q, rate * now.v
        x[at] = rate * (then.v - now.v) / dt if self._accelerates else (then.q - now.q) / dt

    def _at(self, t: float) -> State:
        """The motion at a time [s]; the last one is kept, as it is asked for again in the next tick."""
        if self._later is None or self._later[0] != t:
            assert self._motion is not None or self._table is not None
            found = self._motion.at(t) if self._table is None and self._motion is not None else self._row(t)
            self._later = t, found
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
        if self._motion is None:
            return False
        command: JointState = self._view.command
        now, at = self._at(t), self._working
        far = np.abs(command.q[at] - now.q) > DEVIATION
        return bool((far | (np.abs(command.v[at] - now.v) > self._slow)).any())
