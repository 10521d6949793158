"""A planner led by a reference of the tip that waits for the arm."""

from typing import Any, final

import numpy as np

from ftqp.control.planner.planner import Planner
from ftqp.control.planner.planner_view import PlannerView
from ftqp.control.planner.step import Step
from ftqp.control.planner.target import Target
from ftqp.control.references.tip_limits import TipLimits
from ftqp.control.references.tip_reference import TipReference
from ftqp.core.checks import FloatArray
from ftqp.core.pose import rotation_vector
from ftqp.kernel.layout.enums import INVALID_INPUT, STOPPED, STOPPING

LEASH = 0.02
"""How far the reference may be ahead of the tip [m]; less than half the emergency stop's default."""
TURN_LEASH = 0.1
"""The same of its rotation [rad]."""
STANDING = 1e-3
"""A tip slower than this on its leash stands, and its target with it [m/s, rad/s]."""
GIVEN_IN = 1e-4
"""A smaller error is left to the planner when nobody asks for a motion [m, rad]."""
GIVING_IN = 0.1
"""Time constant of the reference's return to the tip then [s]."""
OFF_TASK = (STOPPING, STOPPED, INVALID_INPUT)
"""Codes of steps that do not attempt the task: the reference begins anew at the arm after them."""


@final
class LedTip:
    """The planner's steps along a reference of the tip.

    The reference begins where the command is and as fast. Where the tip stays behind by more than a leash,
    it is drawn back to the leash and goes on with the tip's own twist, so that nothing winds up.

    Args:
        planner: The planner that is led.
        limits: How fast the reference may move.
    """

    def __init__(self, planner: Planner, limits: TipLimits) -> None:
        self.planner = planner
        self.view: PlannerView = planner.view()
        self.reference = TipReference(limits, planner.dt)
        self.on_leash = False
        self.target = Target(pose=np.eye(4))
        self._begun = -1

    def begin(self) -> None:
        """Let the next step begin at the arm."""
        self._begun = -1

    def step(self, q: Any, v: Any, *, pose: FloatArray | None, twist: FloatArray, tau: Any, tip: Any) -> Step:
        """A step with the reference on its way.

        Args:
            q: The measured configuration.
            v: The measured velocity.
            pose: Where the reference goes, (4, 4); None goes along the twist.
            twist: How fast the goal moves, or the reference, (6,); zero without a pose lets the arm rest
                where it is.
            tau: The measured torque, or None.
            tip: The measured pose of the tip, or None.
        """
        planner, view, reference = self.planner, self.view, self.reference
        if self._begun != view.ticks and view.is_reset:
            now = view.tip
            reference.begin(now.pose, now.twist, now.acceleration)
            self.on_leash = False
        p, R, rate = reference.p, reference.R, reference.twist
        if pose is not None:
            reference.towards(pose, twist)
        else:
            reference.along(twist)
        self._aim(p, R, rate)
        step = planner.step(q, v, self.target, tau=tau, tip=tip)
        self._begun = -1 if step.code in OFF_TASK else view.ticks
        self._draw_back(step)
        if pose is None and not twist.any() and not reference.twist.any():
            self._give_in(step)
        return step

    def _aim(self, p: FloatArray, R: FloatArray, rate: FloatArray) -> None:
        """The target: the reference at this tick, with its mean acceleration, or twist, until the next."""
        target, reference, dt = self.target, self.reference, self.planner.dt
        target.pose[:3, :3], target.pose[:3, 3] = R, p
        stands = not (rate.any() or reference.twist.any())
        if stands or (self.on_leash and float(np.abs(rate).max()) < STANDING):
            target.twist[:] = target.acceleration[:] = 0.0
        elif self.planner.level == "velocity":
            target.twist[:3] = (reference.p - p) / dt
            target.twist[3:] = rotation_vector(reference.R @ R.T) / dt
        else:
            target.twist[:] = rate
            target.acceleration[:] = (reference.twist - rate) / dt

    def _draw_back(self, step: Step) -> None:
        far = max(step.position_error / LEASH, step.rotation_error / TURN_LEASH)
        self.on_leash = far > 1.0
        if self.on_leash:
            error = step.task_error
            twist = self.view.tip.twist
            if float(np.abs(twist).max()) < STANDING:
                twist = np.zeros(6)
            self.reference.pull(
                -max(0.0, 1.0 - LEASH / max(step.position_error, LEASH)) * error[:3],
                -max(0.0, 1.0 - TURN_LEASH / max(step.rotation_error, TURN_LEASH)) * error[3:],
                twist,
            )

    def _give_in(self, step: Step) -> None:
        """Nobody asks for a motion: where the arm has not followed, the reference comes to the tip."""
        if step.position_error > GIVEN_IN or step.rotation_error > GIVEN_IN:
            share = min(1.0, self.planner.dt / GIVING_IN)
            self.reference.pull(-share * step.task_error[:3], -share * step.task_error[3:], np.zeros(6))
