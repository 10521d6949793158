"""The shortest motion from one state to another within limits of speed, acceleration and jerk."""

from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple, final

import numpy as np
import ruckig

from ftqp.core.checks import FloatArray
from ftqp.core.pose import rotation_exp, rotation_vector, skew
from ftqp.core.setting import refuse_out_of_range, setting
from ftqp.kernel.layout.thresholds import ENDLESS, RISE_TIME

TOUCHING = 1.0 - 1e-9
"""Share of a limit that a target's own speed may have at most. So that rounding never takes it past the
limit, which ruckig would refuse."""


class State(NamedTuple):
    """Coordinates of a motion with their first and second derivatives, (n,) each."""

    q: FloatArray
    v: FloatArray
    a: FloatArray


@final
class Motion:
    """Several coordinates that move together, each within its own limits and with limited jerk.

    A state beyond the limits is brought within them first. Where all coordinates can share one time law the
    motion is straight, else they arrive at the same time.

    Source: Berscheid 2021, whose library ``ruckig`` computes the profiles.
    """

    def __init__(self, size: int) -> None:
        self._solver = ruckig.Ruckig(size)
        self._input = ruckig.InputParameter(size)
        self._input.synchronization = ruckig.Synchronization.Phase
        self._trajectory = ruckig.Trajectory(size)
        self._standing: State | None = None
        self._end: State | None = None
        self._rests = True

    def plan(
        self,
        state: State,
        goal: FloatArray,
        v_max: FloatArray,
        a_max: FloatArray,
        jerk: FloatArray,
        *,
        goal_v: FloatArray | None = None,
    ) -> bool:
        """Plan the motion to a place; False where it can only brake to rest."""
        top = np.minimum(v_max, ENDLESS)
        end = np.zeros(len(goal)) if goal_v is None else np.clip(goal_v, -TOUCHING * top, TOUCHING * top)
        given = self._input
        given.control_interface = ruckig.ControlInterface.Position
        given.target_position = goal.tolist()
        if self._planned(state, end, top, a_max, jerk):
            return True
        self.brake(state, a_max, jerk)
        return False

    def brake(
        self, state: State, a_max: FloatArray, jerk: FloatArray, velocity: FloatArray | None = None
    ) -> None:
        """Plan the change to a velocity, wherever it happens."""
        given = self._input
        given.control_interface = ruckig.ControlInterface.Velocity
        end = np.zeros(len(state.q)) if velocity is None else velocity
        if not self._planned(state, end, np.full(len(end), ENDLESS), a_max, jerk):
            self._standing = State(state.q.copy(), np.zeros(len(end)), np.zeros(len(end)))

    def at(self, t: float) -> State:
        """The motion at a time [s] after its plan was made; after its end it goes on as it ended."""
        if self._standing is not None:
            return self._standing
        if self._rests and t >= self.duration:
            if self._end is None:
                place = np.array(self._trajectory.at_time(self.duration)[0])
                self._end = State(place, np.zeros(len(place)), np.zeros(len(place)))
            return self._end
        q, v, a = self._trajectory.at_time(t)[:3]
        return State(np.array(q), np.array(v), np.array(a))

    @property
    def duration(self) -> float:
        """How long the motion takes [s]."""
        return 0.0 if self._standing is not None else float(self._trajectory.duration)

    def _planned(
        self, state: State, end: FloatArray, v_max: FloatArray, a_max: FloatArray, jerk: FloatArray
    ) -> bool:
        given = self._input
        given.target_acceleration = [0.0] * len(end)
        given.current_position = state.q.tolist()
        given.current_velocity = state.v.tolist()
        given.current_acceleration = state.a.tolist()
        given.target_velocity = end.tolist()
        given.max_velocity = v_max.tolist()
        given.max_acceleration = a_max.tolist()
        given.max_jerk = jerk.tolist()
        self._standing = self._end = None
        self._rests = not end.any()
        try:
            result = self._solver.calculate(given, self._trajectory)
        except (ruckig.RuckigError, ValueError):  # it refuses the numbers, or has no name for what it found
            return False
        return bool(result in (ruckig.Result.Working, ruckig.Result.Finished))


LEAST_SHARE = 0.2
"""Share of a limit that every axis has at least, before the shares are made one vector of length 1. So that
no axis is so slow that it prolongs the motion of the others."""
FARTHEST = 100.0
"""A goal beyond so many seconds at full speed is neared as if it were there."""
FLAT = 1e-4
"""An angle [rad] below which a series replaces the formula, as 1 - cos has lost half of its digits there."""
BEND_STEP = 1e-4
"""Step of the difference quotient that gives the change of J [s]. The quotient is off by 1e-8 of the
curvature's change, and rounding leaves 1e-12 of it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TipLimits:
    """Limits of the reference that leads to a goal; the arm's own limits hold, too.

    Args:
        speed: The largest linear speed, > 0 [m/s]. A larger one arrives sooner.
        acceleration: The largest linear acceleration, > 0 [m/s2]. A larger one starts and brakes harder.
        turn: The largest angular speed, > 0 [rad/s].
        turn_acceleration: The largest angular acceleration, > 0 [rad/s2].
        rise_time: How long an acceleration takes to reach its limit, > 0 [s], which limits the jerk. A longer
            one is softer and later.

    Raises:
        InputError: A limit is not positive or not finite.
    """

    speed: float = setting(0.5, unit="m/s", above=0.0)
    acceleration: float = setting(2.0, unit="m/s2", above=0.0)
    turn: float = setting(1.5, unit="rad/s", above=0.0)
    turn_acceleration: float = setting(6.0, unit="rad/s2", above=0.0)
    rise_time: float = setting(RISE_TIME, unit="s", above=0.0)

    def __post_init__(self) -> None:
        refuse_out_of_range(self)


@final
class TipReference:
    """Place, velocity and acceleration of a reference of the tip.

    Position and rotation vector x = (p, xi), R = exp(xi) R_0, move as six coordinates of a ``Motion``. Each
    has a share s_i of its limit with |s| = 1, the larger where the way, the velocity or the acceleration is
    larger, so that the limits hold for the norms.

    Source: docs/theory/ways-to-a-goal.md.
    """

    def __init__(self, limits: TipLimits, dt: float) -> None:
        self.limits = limits
        self._dt = dt
        self._fastest = np.repeat([limits.speed, limits.turn], 3)
        self._v_max, self._share = self._fastest, 1.0
        self._a_max = np.repeat([limits.acceleration, limits.turn_acceleration], 3)
        self._motion = Motion(6)
        self.begin(np.eye(4), np.zeros(6))

    def begin(self, pose: FloatArray, twist: FloatArray, acceleration: FloatArray | None = None) -> None:
        """Be at a pose with a twist and an acceleration; the plan is forgotten."""
        self.p, self.R = pose[:3, 3].copy(), pose[:3, :3].copy()
        self.twist = twist.copy()
        self.acceleration = np.zeros(6) if acceleration is None else acceleration.copy()
        self._goal: FloatArray | None = None

    def pace(self, share: float) -> None:
        """Move at a share of the limits of speed from the next sample on, and of a twist alone."""
        if share != self._share:
            self._share, self._v_max, self._goal = share, share * self._fastest, None

    def displace(self, shift: FloatArray, turn: FloatArray, twist: FloatArray) -> None:
        """Be displaced, and go on from there with another twist."""
        self.p = self.p + shift
        self.R = rotation_exp(turn) @ self.R
        self.twist, self.acceleration = twist.copy(), np.zeros(6)
        self._goal = None

    def towards(self, pose: FloatArray, twist: FloatArray) -> None:
        """Go one sample on the way to a pose, and be as fast as it is on arrival."""
        goal = np.concatenate([pose.ravel(), twist])
        if self._goal is None or not np.array_equal(goal, self._goal):
            self._plan(pose, twist)
            self._goal = goal
        self._advance()

    def along(self, twist: FloatArray) -> None:
        """Go one sample on, and become as fast as a twist."""
        if not (twist.any() or self.twist.any() or self.acceleration.any()):
            return
        wanted = self._share * twist
        for part in (slice(0, 3), slice(3, 6)):
            size, top = float(np.linalg.norm(wanted[part])), float(self._v_max[part][0])
            if size > top:
                wanted[part] *= top / size
        self._start()
        a_max = self._shares(wanted - self.twist) * self._a_max
        self._motion.brake(self._state(), a_max, a_max / self.limits.rise_time, wanted)
        self._goal = None
        self._advance()

    def _plan(self, pose: FloatArray, twist: FloatArray) -> None:
        self._start()
        turn = rotation_vector(pose[:3, :3] @ self.R.T)
        way = np.concatenate([pose[:3, 3] - self.p, turn])
        for part in (slice(0, 3), slice(3, 6)):
            size, farthest = float(np.linalg.norm(way[part])), FARTHEST * float(self._v_max[part][0])
            if size > farthest:
                way[part] *= farthest / size
        end = twist.copy()
        end[3:] = np.linalg.solve(_left_jacobian(way[3:]), twist[3:])
        share = self._shares(way, end)
        a_max = share * self._a_max
        goal = way + np.concatenate([self.p, np.zeros(3)])
        self._motion.plan(
            self._state(), goal, share * self._v_max, a_max, a_max / self.limits.rise_time, goal_v=end
        )

    def _start(self) -> None:
        self._t = 0.0
        self._R0 = self.R @ (3.0 * np.eye(3) - self.R.T @ self.R) / 2.0  # rounding must not add up

    def _state(self) -> State:
        return State(np.concatenate([self.p, np.zeros(3)]), self.twist, self.acceleration)

    def _shares(self, way: FloatArray, end: FloatArray | None = None) -> FloatArray:
        """Share of each axis of the limits, (6,), of length 1 over the linear and over the angular ones."""
        result = np.empty(6)
        for part in (slice(0, 3), slice(3, 6)):
            size = float(np.linalg.norm(way[part]))
            share = np.full(3, LEAST_SHARE)
            if size > 0.0:
                moves = self.twist[part].any() or self.acceleration[part].any()
                share = np.maximum(share if moves else 0.0, np.abs(way[part]) / size)
            share = np.maximum(share, np.abs(self.twist[part]) / self._v_max[part])
            share = np.maximum(share, np.abs(self.acceleration[part]) / self._a_max[part])
            if end is not None:
                share = np.maximum(share, np.minimum(np.abs(end[part]) / self._v_max[part], 1.0))
            share = np.maximum(share, 1e-3)
            result[part] = share / np.linalg.norm(share)
        return result

    def _advance(self) -> None:
        """The next sample of the plan."""
        self._t += self._dt
        x, v, a = self._motion.at(self._t)
        xi, rate, change = x[3:], v[3:], a[3:]
        self.p = x[:3]
        self.R = rotation_exp(xi) @ self._R0
        if not (xi.any() or rate.any()):
            self.twist, self.acceleration = v, a
            return
        J = _left_jacobian(xi)
        self.twist = np.concatenate([v[:3], J @ rate])
        ahead, behind = _left_jacobian(xi + BEND_STEP * rate), _left_jacobian(xi - BEND_STEP * rate)
        bend = (ahead - behind) @ rate / (2.0 * BEND_STEP)
        self.acceleration = np.concatenate([a[:3], J @ change + bend])


def _left_jacobian(xi: FloatArray) -> FloatArray:
    """J with omega = J(xi) xi' for R = exp(xi), (3, 3): I + (1 - cos t)/t^2 [xi] + (t - sin t)/t^3 [xi]^2."""
    t = sqrt(float(xi @ xi))
    X = skew(xi)
    if t < FLAT:
        return np.eye(3) + 0.5 * X + X @ X / 6.0
    result: FloatArray = np.eye(3) + (1.0 - np.cos(t)) / t**2 * X + (t - np.sin(t)) / t**3 * (X @ X)
    return result
