"""A planner led by a motion of the joints to a posture."""

from typing import Any, final

import numpy as np

from ftqp.control.inverse_kinematics.passable import HELD
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.planner_view import JointState, PlannerView
from ftqp.control.planner.step import Step
from ftqp.control.references.jerk_limit import ENDLESS, Motion, State
from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.session import JointsMemory
from ftqp.kernel.layout.enums import INVALID_INPUT, STOPPED, STOPPING
from ftqp.kernel.layout.record import capacity_for

BANDWIDTH = 20.0
"""How fast an error to the motion decays, at most [1/s] ..."""
BANDWIDTH_STEPS = 0.2
"""... and times dt, at most: a fifth of it is taken off in a tick, so that the sampled loop does not
overshoot. A guess that the campaigns have not contradicted."""

DEVIATION = 0.01
"""A command so far from the motion begins it anew, because limits have held the arm back: by its place [rad
or m] ..."""
SPEED_DEVIATION = 0.05
"""... or by its speed, as a share of v_max. A guess that the campaigns have not contradicted."""

SPEED_SHARE, ACCELERATION_SHARE = 0.999, 0.99
"""Shares of the limits that the motion uses: what is left corrects errors at full speed. A guess that the
campaigns have not contradicted."""
LEAST_ACCELERATION = 0.05
"""Share of a_max that the motion uses even where gravity leaves less, so that it ends. A guess that the
campaigns have not contradicted."""

PLACES = 17
"""Whether motors hold the arm is looked at in so many places of a motion, ..."""
FINER = 10
"""... and in so many between the last at which they do and the next."""
NEARER_ENDS = 8
"""So many nearer ends are tried before the arm is left where it stands."""
OFF_TASK = (STOPPING, STOPPED, INVALID_INPUT)
"""Codes of steps that are no part of the motion, which begins anew after them."""


@final
class LedJoints:
    """The planner's steps along a jerk-limited motion of the joints that work.

    It is planned from the last command, anew at the very tick at which the belief in a joint or a limit
    changes, or ``planner.pace``, so that position and velocity go on without a jump.

    Args:
        planner: The planner that is led.
        goal: The posture to go to, (nv,) [rad or m].
        rise_time: How long an acceleration takes to reach its limit, > 0 [s].
    """

    def __init__(self, planner: Planner, goal: FloatArray, rise_time: float) -> None:
        n = planner.robot.nv
        memory = JointsMemory(capacity_for(n))
        self._lead = planner.lead(memory)
        self._joints = memory.joints
        bandwidth = min(BANDWIDTH, BANDWIDTH_STEPS / planner.dt)
        self._accelerates = planner.level == "acceleration"
        memory.joints.kp = bandwidth**2 if self._accelerates else bandwidth
        memory.joints.kv = 2.0 * bandwidth if self._accelerates else 0.0
        self.planner = planner
        self.view: PlannerView = planner.view()
        self.goal = goal
        self._rise_time = rise_time
        self._motion: Motion | None = None
        self._working = np.zeros(0, dtype=np.int64)
        self._t = 0.0
        self._begun, self._belief, self._speed = -1, b"", 1.0
        self._looked_at = b""
        self.too_heavy: str | None = None
        """The joint whose motor cannot hold the arm farther on the way; None where all can."""

    def begin(self) -> None:
        """Let the next step begin at the arm."""
        self._begun, self._looked_at = -1, b""

    def aim(self, goal: FloatArray) -> None:
        """Go to another posture from the next step on.

        Args:
            goal: (nv,) [rad or m].
        """
        self.goal = goal
        self.begin()

    @property
    def way(self) -> FloatArray:
        """What is left of the way of every joint as commanded, (nv,) [rad or m]; the short way round."""
        return self.way_from(self.view.command.q)

    def way_from(self, q: FloatArray) -> FloatArray:
        """From joint positions to the goal, (nv,) [rad or m]; for a continuous joint the short way round.

        Args:
            q: Joint positions, (nv,) [rad or m].
        """
        way = self.goal - q
        turns = self.planner.robot.continuous
        return np.where(turns, np.remainder(way + np.pi, 2.0 * np.pi) - np.pi, way)

    def step(self, q: Any, v: Any, tau: Any, tip: Any) -> Step:
        """A step on the way; see ``Planner.step``."""
        view = self.view
        if view.is_reset:
            belief, speed = view.belief, self.planner.pace
            if self._begun != view.ticks or self._belief != belief or self._speed != speed:
                self._belief, self._speed = belief, speed
                self._plan()
            self._write()
        step = self._lead.step(q, v, (), tau, tip)
        self._t += self.planner.dt
        off = step.code in OFF_TASK or self._has_left()
        self._begun = -1 if off else view.ticks
        return step

    def _plan(self) -> None:
        command, limits, robot = self.view.command, self.view.limits, self.planner.robot
        working = np.flatnonzero(self.view.working)
        if self._motion is None or len(working) != len(self._working):
            self._motion = Motion(len(working)) if len(working) else None
        self._working, self._t = working, 0.0
        if self._motion is None:
            return
        goal = command.q + self.way_from(command.q)
        goal = np.clip(goal, limits.q_min, limits.q_max)[working]
        a_max = ACCELERATION_SHARE * np.maximum(limits.a, LEAST_ACCELERATION * robot.limits.a_max)[working]
        start = State(*(part[working] for part in command))
        v_max = self._speed * SPEED_SHARE * limits.v[working]
        jerk = np.minimum(robot.limits.a_max / self._rise_time, robot.limits.j_max)[working]
        jerk *= ACCELERATION_SHARE
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
        looked_at, self._looked_at = self._looked_at, self._belief
        if looked_at == self._belief and self.too_heavy is None:
            return False
        self.too_heavy = None
        return bool(np.isfinite(tau_max).any())

    def _last_held(self, tau_max: FloatArray) -> FloatArray | None:
        """The last place of the motion up to which motors can hold the arm; None where they can all the way.

        Motors that cannot hold it where the motion begins count as strong enough for what they need there.

        Args:
            tau_max: Torque limits of the joints that work [N m or N].
        """
        assert self._motion is not None
        at = self._working
        places = np.tile(self.view.command.q, (PLACES, 1))
        for place, t in zip(places, np.linspace(0.0, self._motion.duration, PLACES), strict=True):
            place[at] = self._motion.at(float(t)).q
        share = np.abs(self.view.holding_torques(places)[:, at]) / tau_max
        least = max(HELD, float(share[0].max()))
        beyond = np.flatnonzero(share.max(axis=1) > least)
        if not len(beyond):
            return None
        first = int(beyond[0])
        self.too_heavy = self.planner.robot.joints[int(at[np.argmax(share[first])])]
        between = np.linspace(places[first - 1], places[first], FINER, endpoint=False)
        share = np.abs(self.view.holding_torques(between)[:, at]) / tau_max
        held = np.logical_and.accumulate(share.max(axis=1) <= least)
        last: FloatArray = between[max(0, int(held.sum()) - 1), at]
        return last

    def _write(self) -> None:
        """The motion at this tick and what it asks until the next."""
        if self._motion is None:
            return
        joints, at, dt = self._joints, self._working, self.planner.dt
        now, then = self._motion.at(self._t), self._motion.at(self._t + dt)
        joints.q[at], joints.v[at] = now.q, now.v
        joints.x[at] = (then.v - now.v) / dt if self._accelerates else (then.q - now.q) / dt

    def _has_left(self) -> bool:
        """Whether the command is not where the motion is."""
        if self._motion is None:
            return False
        command: JointState = self.view.command
        now, at = self._motion.at(self._t), self._working
        slow = SPEED_DEVIATION * np.minimum(self.view.limits.v[at], ENDLESS)
        far = np.abs(command.q[at] - now.q) > DEVIATION
        return bool((far | (np.abs(command.v[at] - now.v) > slow)).any())
