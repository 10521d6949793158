"""The arms of a session, and what leads each: a path, a goal, a hand, or a way out."""

from collections.abc import Callable
from dataclasses import dataclass
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
from ftqp.core.checks import FloatArray, frozen
from ftqp.faults.kinds import Fault
from ftqp.model.robot import Robot
from ftqp.sim.leader import ClockLeader, ClockTargets, Leader, LedArm, ProgressLeader, Standing
from ftqp.sim.plants.plant import Plant
from ftqp.sim.rival import ResolvedRates
from ftqp.sim.schedule import Schedule
from ftqp.sim.sensors.joint_sensors import JointSensors
from ftqp.sim.session.frame import DrawnArm, Twin

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


SessionArm = LedArm[SessionLeader]
"""An arm of a session, with its planner."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SessionRival:
    """What a rival has of its own."""

    plant: Plant  # Its arm, the same once more
    sensors: JointSensors | None  # What is measured of it; None measures the truth
    rows: tuple[str, ...]  # What of the pose it follows


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """What a person has chosen to see; None is what the scenario says."""

    scenario: str  # Name or path of a scenario
    overrides: tuple[str, ...] = ()  # ``a.b=value`` each, put into the scenario before it is checked
    plan: str | None = None  # File of a plan that leads the null space
    robot: str | None = None  # Name of a catalog robot
    scheme: str | None = None  # Name of a scheme
    backend: str | None = None  # Name of a backend
    detector: bool | None = None  # Whether the planner looks for failures by itself
    box: bool = False  # Whether a box stands beside the path, which the arm keeps clear of


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SessionArms:
    """All that takes part in a session."""

    title: str  # What is shown
    robot: Robot  # The arm
    path: Path  # What its tip follows
    q: FloatArray  # Where it starts, (nv,) [rad or m]
    v: FloatArray  # How fast, (nv,) [rad/s or m/s]
    schedule: Schedule  # What fails by itself
    arm: SessionArm  # The arm and its planner
    rival: SessionRival | None = None  # The arm of damped resolved rates beside it; None without one
    detects: bool = False  # Whether the planner has a detector, so that a click need not tell it
    urdf: str | None = None  # The file that the arm was read from, for pictures; None of an arm without one
    box: bool = False  # Whether a box was put beside the path


ArmsOf = Callable[[Choice], SessionArms]
"""Makes the arms of a choice; raises `FtqpError` with one sentence where that cannot be."""


LINEAR = ("x", "y", "z")


@final
class RivalArm:
    """It follows the path of an arm beside it, failing and told as that is, and rests while a hand leads."""

    def __init__(self, rival: SessionRival, beside: SessionArm) -> None:
        self._plant, self._sensors, self._beside = rival.plant, rival.sensors, beside
        robot: Robot = beside.planner.robot
        self._robot, self._drawn = robot, DrawnArm(robot)
        self._rates = ResolvedRates(robot, beside.planner.dt, rows=rival.rows)
        self._error_rows = [LINEAR.index(row) for row in rival.rows if row in LINEAR]
        self._failed: dict[int, Fault] = {}
        self._reported: set[int] = set()
        self._here = True

    def begin(self, q: FloatArray, v: FloatArray) -> None:
        """Tick 0: the healthy arm at (q, v), each (nv,)."""
        self._failed.clear()
        self._reported.clear()
        self._start(q, v)

    def _start(self, q: FloatArray, v: FloatArray) -> None:
        """Put it at (q, v), each (nv,), with the failures that there are."""
        self._here = True
        self._plant.reset(q, v)
        if self._sensors is not None:
            self._sensors.reset()
        self._rates.reset(q, v)
        for i, fault in self._failed.items():
            self._plant.fail(fault)
            if i in self._reported:
                self._rates.tell(i)

    def fail(self, fault: Fault) -> None:
        """Let a joint fail."""
        self._plant.fail(fault)
        self._failed[self._robot.joint(fault.joint)] = fault

    def tell(self, fault: Fault) -> None:
        """Tell it of a failure; of a joint that is only weaker it can make nothing."""
        if not fault.works:
            i = self._robot.joint(fault.joint)
            self._reported.add(i)
            self._rates.tell(i)

    def repair(self, joint: str) -> None:
        """Let a joint work again; its drive is switched on where the joint is."""
        i = self._robot.joint(joint)
        self._plant.repair(joint)
        self._failed.pop(i, None)
        self._reported.discard(i)
        self._rates.repair(i, float(self._plant.q[i]))

    @property
    def failure(self) -> str | None:
        """Why its simulation cannot go on, or None."""
        if self._plant.failure is not None:
            return self._plant.failure
        if np.isfinite(self._plant.q).all() and np.isfinite(self._plant.v).all():
            return None
        return "the position of a joint is not a number any more"

    def plan_step(self, k: int) -> None:
        """Its command at this tick, after the other arm has thought."""
        leader, plant = self._beside.leader, self._beside.plant
        if leader.on_path and not self._here:
            self._start(plant.q, plant.v)
        self._here = leader.on_path
        if not self._here:
            return
        q = self._plant.q
        if self._sensors is not None:
            self._sensors.measure(q, self._plant.v)
            q = self._sensors.q
        target = leader.target
        self._rates.step(q, target.pose, np.asarray(target.twist))

    def move(self) -> None:
        """Let it move on."""
        if self._here:
            self._plant.advance(self._rates)

    def seen(self) -> Twin | None:
        """What a picture needs of it; None while it is not there."""
        if not self._here:
            return None
        q = self._plant.q
        off = self._robot.pose(q)[:3, 3] - self._beside.leader.target.pose[:3, 3]
        return Twin(
            joints=self._drawn.joints(q),
            q=frozen(q.copy()),
            error=float(np.linalg.norm(off[self._error_rows])),
            reported=bool(self._failed) and self._reported.issuperset(self._failed),
        )
