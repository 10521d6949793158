"""The shortest motion from one state to another within limits of speed, acceleration and jerk."""

from typing import NamedTuple, final

import numpy as np
import ruckig

from ftqp.core.checks import FloatArray
from ftqp.kernel.layout.thresholds import ENDLESS

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
        goal_a: FloatArray | None = None,
        least: float = 0.0,
    ) -> bool:
        """Plan the motion to a place in ``least`` [s] or more; False where it can only brake to rest."""
        top = np.minimum(v_max, ENDLESS)
        end = np.zeros(len(goal)) if goal_v is None else np.clip(goal_v, -TOUCHING * top, TOUCHING * top)
        given = self._input
        given.control_interface = ruckig.ControlInterface.Position
        given.target_position = goal.tolist()
        given.target_acceleration = np.zeros(len(goal)).tolist() if goal_a is None else goal_a.tolist()
        given.minimum_duration = least if least > 0.0 else None
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
        given.target_acceleration, given.minimum_duration = [0.0] * len(state.q), None
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
