"""A bridge: from where a path is blocked to another posture of that place, from which it goes on."""

from typing import Any, Final, final

import numpy as np

from ftqp.control.following.ahead import PathLookahead
from ftqp.control.following.goal_ways import GoalWays
from ftqp.control.following.led_joints import JointTracker
from ftqp.control.following.on_the_spot import SelfMotionPlanner
from ftqp.control.following.path_tube import PathTube
from ftqp.control.paths.path import Path
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.step import Step
from ftqp.control.references.jerk_limit import RISE_TIME
from ftqp.core.checks import FloatArray
from ftqp.kernel.layout.enums import HELD, STOPPED, STOPPING
from ftqp.kernel.layout.thresholds import AT_REST

ARRIVED: Final = 1e-4
"""A command so near to its place has arrived [rad or m], by convention: the path's feedback does the rest."""


@final
class Reconfiguration:
    """Thinks of a bridge, a piece in every tick, while the tip waits, and leads the joints over it.

    Attributes:
        leads: Whether the joints are led, and not the tip along its path.
        done: Whether the arm is where the path goes on.
        failed: Whether there is no bridge.

    Source: docs/theory/ways-out.md.
    """

    def __init__(self, planner: Planner, path: Path, progress: float, leave: float) -> None:
        self._planner, self._view = planner, planner.view()
        self._belief = self._view.belief
        self._ahead = ahead = PathLookahead(planner, path, progress)
        self._leave = leave
        self._tube = PathTube(planner, path, leave) if np.isfinite(leave) else None
        self._ways = self._thoughts()
        self._joints = JointTracker(planner, self._view.command.q, RISE_TIME, ahead.pose, whole=False)
        self._way: list[FloatArray] = []
        self.leads = self.done = self.failed = self._waits = False

    def _thoughts(self) -> GoalWays | SelfMotionPlanner:
        """What thinks of ways: near the path, or of any."""
        if self._tube is not None:
            return SelfMotionPlanner(self._planner, self._ahead, self._tube)
        ways = GoalWays(self._planner, self._ahead.pose, reach=lambda q: self._ahead.reached(q, ways.search))
        return ways

    @property
    def until(self) -> float:
        """The path time at which the way comes back to the path [s]."""
        return self._ways.until if isinstance(self._ways, SelfMotionPlanner) else self._ahead.progress

    @property
    def sentence(self) -> str:
        """What is being done, or was looked for."""
        within = f", the end effector within {1e3 * self._leave:.3g} mm of its path" * bool(
            np.isfinite(self._leave)
        )
        if self.leads and not self._waits:
            return f"the joints go to another posture, from which the path goes on{within}"
        if self.failed:
            return f"no bridge was found{within}: {self._ways.sentence}"
        return (
            f"a posture from which the path goes on is looked for{within}: {self._ways.starts} starts so far"
        )

    def think(self) -> None:
        """Think for one tick, until the joints are to be led or there is no bridge."""
        if self._belief != self._view.belief:
            self._belief, self.failed = self._view.belief, False
            self._ways = self._thoughts()
        if self.failed:
            return
        self._ways.think()
        if self._ways.is_ready:
            if isinstance(self._ways, GoalWays):
                self._joints.seek(self._ways.take())
            else:
                self._way = list(self._ways.take())
                self._joints.aim(self._way.pop(0))
            self.leads, self._waits = True, False
        elif self._ways.is_over:
            self.failed = True

    def step(self, q: Any, v: Any, tau: Any, tip: Any) -> Step:
        """A step of the joints over the bridge; see ``Planner.step``."""
        if self._belief != self._view.belief and self._view.is_reset:
            self._joints.aim(self._view.command.q)  # another joint has failed: think anew, from here
            self._waits = True
        step = self._joints.step(q, v, tau, tip)
        if step.code in (STOPPING, STOPPED, HELD):
            return step
        if self._waits:
            self.think()
            return step
        working = self._view.working
        off = float(np.abs(self._joints.way[working]).max(initial=0.0))
        top = np.minimum(self._view.limits.v, 1.0 / AT_REST)
        slow = bool((np.abs(self._view.command.v) <= AT_REST * top)[working].all())
        if slow and off <= ARRIVED:
            if self._way:
                self._joints.aim(self._way.pop(0))
            else:
                self.done = True
        return step
