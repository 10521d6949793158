"""A planner led by a motion of the joints to a posture."""

from typing import Any, final

from ftqp.control.planner.joint_motion import JointMotion
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.planner_view import PlannerView
from ftqp.control.planner.step import Step
from ftqp.core.checks import FloatArray
from ftqp.kernel.layout.enums import HELD, INVALID_INPUT, STOPPED, STOPPING

OFF_TASK = (STOPPING, STOPPED, INVALID_INPUT, HELD)
"""Codes of steps that are no part of the motion, which begins anew after them."""


@final
class JointTracker:
    """The planner's steps along a jerk-limited motion of the joints that work.

    It is planned from the last command, anew at the very tick at which the belief in a joint or a limit
    changes, or ``planner.pace``, so that position and velocity go on without a jump.
    """

    def __init__(
        self,
        planner: Planner,
        goal: FloatArray,
        rise_time: float,
        meant: FloatArray | None = None,
        *,
        whole: bool = True,
    ) -> None:
        self.planner = planner
        self.view: PlannerView = planner.view()
        self._motion = JointMotion(self.view, planner.robot, planner.dt, planner.level, rise_time)
        self._motion.goal = goal
        self._lead = planner.lead(self._motion.memory, meant)
        self._t = 0.0
        self._whole = whole
        self._begun, self._belief, self._speed = -1, b"", 1.0

    def begin(self) -> None:
        """Let the next step begin at the arm."""
        self._begun = -1
        self._motion.forget()
        if self._whole:
            self.view.keep_rows()

    def aim(self, goal: FloatArray) -> None:
        """Go to another posture from the next step on."""
        self._motion.goal = goal
        self.begin()

    @property
    def too_heavy(self) -> str | None:
        """The joint whose motor cannot hold the arm farther on the way; None where all can."""
        return self._motion.too_heavy

    @property
    def way(self) -> FloatArray:
        """What is left of the way of every joint as commanded, (nv,) [rad or m]; the short way round."""
        return self.way_from(self.view.command.q)

    def way_from(self, q: FloatArray) -> FloatArray:
        """From joint positions to the goal, (nv,) [rad or m]; for a continuous joint the short way round."""
        return self._motion.way_from(q)

    def step(self, q: Any, v: Any, tau: Any, tip: Any) -> Step:
        """A step on the way; see ``Planner.step``."""
        view = self.view
        if view.is_reset:
            belief, speed = view.belief, self.planner.pace
            if self._begun != view.ticks or self._belief != belief or self._speed != speed:
                self._belief, self._speed, self._t = belief, speed, 0.0
                self._motion.plan(speed)
            self._motion.write(self._t)
        step = self._lead.step(q, v, (), tau, tip)
        self._t += self.planner.dt
        off = step.code in OFF_TASK or self._motion.is_left_at(self._t)
        self._begun = -1 if off else view.ticks
        return step
