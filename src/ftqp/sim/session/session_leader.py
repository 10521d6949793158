"""What leads an arm for as long as somebody watches: its path again and again, or a hand, or the way back."""

from typing import final

import numpy as np

from ftqp.control.following.goto import GoTo
from ftqp.control.following.goto_status import GoToStatus
from ftqp.control.following.path_follower import PathFollower, PathStatus
from ftqp.control.following.target_follower import TargetFollower
from ftqp.control.paths.path import Backwards, Path, Repeated, is_closed
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.step import Step
from ftqp.control.planner.target import Target
from ftqp.control.planner.ways.way_out import WayOut
from ftqp.core.checks import FloatArray
from ftqp.sim.leader import ClockLeader, ClockTargets, Leader, ProgressLeader, Standing

LAPS = 1_000_000
"""Laps of a path that goes by the clock; nobody watches longer."""
DETOURS = 2
"""The ways back after the direct one: to the posture of the start, and from there to the path again."""


@final
class SessionLeader(Leader):
    """Leads the arm along its path without end, where a hand points, and back by a GoTo or its posture."""

    def __init__(
        self, planner: Planner, path: Path, progress: PathFollower | None = None, *, mean: bool = False
    ) -> None:
        self._planner = planner
        self._start = path.start
        self._followers: tuple[PathFollower, ...] = ()
        ways: tuple[ClockLeader | ProgressLeader, ...]
        if progress is None:
            repeated = Repeated(path, LAPS)
            ways = (ClockLeader(planner, ClockTargets(repeated, planner.dt, mean=mean)),)
        elif is_closed(path):
            self._followers = (progress,)
        else:
            self._followers = (progress, PathFollower(planner, Backwards(path), stall=progress.stall))
        self._ways = ways if progress is None else tuple(map(ProgressLeader, self._followers))
        self._way = 0
        self._begun = 0
        self._hand: TargetFollower | None = None
        self._back: GoTo | None = None
        self._out: GoTo | None = None
        self._q, self._detours = planner.robot.neutral.copy(), 0
        self._aim = Target(pose=path.start)

    def reset(self, q: FloatArray, v: FloatArray, ticks: int) -> None:
        self._hand = self._back = self._out = None
        self._begun, self._way, self._q = 0, 0, q.copy()
        self._path.reset(q, v, ticks)

    def follow(self, pose: FloatArray | None) -> None:
        """Go to where a hand points from the next tick on."""
        if pose is None:
            if self._hand is not None or self._out is not None:
                self.go_back()
            return
        self._aim = Target(pose=pose)
        if self._hand is None:
            self._hand, self._back, self._out = TargetFollower(self._planner), None, None

    def take(self, way: WayOut) -> None:
        """Go a way out and stay at its end, until a hand leads or the path is given back."""
        self._hand = self._back = None
        self._out = GoTo(self._planner, way=way)

    def go_back(self) -> None:
        """Go to where the path begins and follow it from there."""
        self._hand = self._out = None
        self._back, self._detours = GoTo(self._planner, pose=self._start), 0

    def resume(self) -> None:
        """Try a path anew that was blocked, because a joint works again."""
        if self._followers:
            self._followers[self._way].resume()

    def aim(self, k: int, q: FloatArray) -> None:
        if self._back is not None:
            self._go_on_back(self._back, k)
        if not self.on_path:
            return
        if self._followers and self._followers[self._way].status is PathStatus.DONE:
            self._start_lap(k, (self._way + 1) % len(self._followers))
        self._path.aim(k - self._begun, q)

    def _go_on_back(self, back: GoTo, k: int) -> None:
        """The path once its start is reached; by the posture of the start where it is not reached."""
        if back.status is GoToStatus.REACHED and self._detours % 2 == 0:
            self._back = None
            self._start_lap(k, 0)
        elif back.done and back.status is not GoToStatus.HALTED and self._detours < DETOURS:
            self._detours += 1
            if self._detours % 2 == 1:
                self._back = GoTo(self._planner, q=self._q)
            else:
                self._back = GoTo(self._planner, pose=self._start)

    def _start_lap(self, k: int, way: int) -> None:
        self._begun, self._way = k, way
        if self._followers:
            self._followers[way].begin()

    @property
    def _path(self) -> ClockLeader | ProgressLeader:
        """What leads along the path just now: there, or back."""
        return self._ways[self._way]

    def step(self, q: FloatArray, v: FloatArray, tau: FloatArray | None = None) -> Step:
        if self._hand is not None:
            return self._hand.step(q, v, self._aim, tau=tau)
        goes = self._back if self._out is None else self._out
        if goes is not None:
            return goes.step(q, v, tau=tau)
        return self._path.step(q, v, tau)

    @property
    def target(self) -> Target:
        """Where the tip shall be: of the path, of the hand, or where the path begins."""
        if self._hand is not None:
            return self._aim
        goes = self._back if self._out is None else self._out
        return self._path.target if goes is None else Target(pose=goes.pose)

    @property
    def on_path(self) -> bool:
        """Whether the path leads, and neither a hand, nor the way back to it, nor a way out."""
        return self._hand is None and self._back is None and self._out is None

    @property
    def by_hand(self) -> bool:
        """Whether a hand leads."""
        return self._hand is not None

    @property
    def sentence(self) -> str:
        """What there is to say beside the status of the step; empty without anything."""
        if self._hand is not None:
            return f"Moved by hand: {self._hand.status.value}."
        if self._out is not None:
            out = self._out
            said = out.sentence if out.done else out.status.value
            return f"On a way out: {said}; to path gives the path back."
        if self._back is not None:
            waits = self._back.done and self._detours == DETOURS
            ending = "; Reset begins anew, or lead the end effector by hand" if waits else ""
            return f"Back to the path: {self._back.sentence}{ending}."
        blocked = self._path.standing.blocked
        return "" if blocked is None else f"The path does not go on: {blocked}."

    @property
    def standing(self) -> Standing:
        """Where the path stands, since it was begun; a session ends when nobody steps it any more."""
        return self._path.standing


def path_points(path: Path, count: int = 120) -> FloatArray:
    """Points along a path, (count + 1, 3) [m]."""
    points: FloatArray = path.sample(np.linspace(0.0, path.duration, count + 1)).pose[:, :3, 3]
    return points
