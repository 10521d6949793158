"""What leads an arm along its path: the clock, the path's own progress, or a task in inertial space."""

from abc import ABC, abstractmethod
from typing import Generic, NamedTuple, TypeVar, final

import numpy as np

from ftqp.control.following.goto import GoTo
from ftqp.control.following.path_follower import PathFollower, PathStatus
from ftqp.control.paths import Path, mean_acceleration
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.step import Step
from ftqp.control.planner.target import Target
from ftqp.core import clock
from ftqp.core.checks import FloatArray
from ftqp.sim.base.moving_world import MovingWorld
from ftqp.sim.log.raw_rows import FELT, SENSED
from ftqp.sim.plants.plant import Plant
from ftqp.sim.sensors.joint_sensors import JointSensors

SAMPLED = 2048
"""Ticks whose targets are sampled together."""
WAITS = 0.5
"""How long the arm is watched after its path was blocked [s]."""


class Standing(NamedTuple):
    """Where a path stands after a tick."""

    progress: float  # Path time of the target of the last step [s]
    reached: float  # Path time that has been reached [s]
    status: PathStatus | None = None  # What its follower says; None where it has no progress of its own
    over: bool = False  # Whether the run ends with the last step, before its time is up
    finished: bool = True  # Whether nothing of the path is left once all ticks are done
    blocked: str | None = None  # Why the path does not go on, or None


class Leader(ABC):
    """The role of what leads an arm: at every tick it takes aim, then gives the command."""

    world: MovingWorld | None = None
    """The base under the arm where it moves; the target is then in the inertial frame."""

    @abstractmethod
    def reset(self, q: FloatArray, v: FloatArray, ticks: int) -> None:
        """Begin a run of at most so many ticks at (q, v), each (nv,)."""

    @abstractmethod
    def aim(self, k: int, q: FloatArray) -> None:
        """Prepare tick k: find the target and take measurements; q is true, (nv,)."""

    @abstractmethod
    def step(self, q: FloatArray, v: FloatArray, tau: FloatArray | None = None) -> Step:
        """The command of the tick at the measured state (q, v) and torques, each (nv,), if there are any."""

    @property
    @abstractmethod
    def target(self) -> Target:
        """What the last step aimed at."""

    @property
    @abstractmethod
    def standing(self) -> Standing:
        """Where the path stands after the last step."""


@final
class ClockTargets:
    """The targets of a path at the ticks of a clock, sampled block by block."""

    def __init__(self, path: Path, dt: float, *, mean: bool) -> None:
        self._path, self._dt, self._mean = path, dt, mean
        self.target = Target(pose=path.start)
        self.reset(1)

    def reset(self, ticks: int) -> None:
        """Begin a run of so many ticks."""
        self._ticks, self._first, self.progress = ticks, -SAMPLED, 0.0

    def aim(self, k: int) -> None:
        """Make ``target`` that of tick k."""
        if not self._first <= k < self._first + SAMPLED:
            self._sample(k)
        at = k - self._first
        self.target.at(self._pose[at], self._twist[at], self._acceleration[at])
        self.progress = min(k * self._dt, self._path.duration)

    def _sample(self, first: int) -> None:
        """Poses, twists and accelerations of the next ticks."""
        t = np.arange(first, min(first + SAMPLED, max(self._ticks, first + 1))) * self._dt
        sample = self._path.sample(t)
        self._first, self._pose, self._twist = first, sample.pose, sample.twist
        self._acceleration = mean_acceleration(self._path, t, self._dt) if self._mean else sample.acceleration


@final
class ClockLeader(Leader):
    """The clock: tick k aims at the path at k dt, whatever the arm does."""

    def __init__(self, planner: Planner, targets: ClockTargets, world: MovingWorld | None = None) -> None:
        self._planner, self.targets, self.world = planner, targets, world

    def reset(self, q: FloatArray, v: FloatArray, ticks: int) -> None:
        if self.world is None:
            self._planner.reset(q, v)
        else:
            self.world.reset(q, v, ticks)
        self.targets.reset(ticks)

    def aim(self, k: int, q: FloatArray) -> None:
        self.targets.aim(k)
        if self.world is not None:
            self.world.sense(k, q)

    def step(self, q: FloatArray, v: FloatArray, tau: FloatArray | None = None) -> Step:
        if self.world is not None:
            return self.world.step(q, v, self.targets.target)
        return self._planner.step(q, v, self.targets.target, tau=tau)

    @property
    def target(self) -> Target:
        return self.targets.target

    @property
    def standing(self) -> Standing:
        return Standing(self.targets.progress, self.targets.progress)


@final
class ProgressLeader(Leader):
    """The path's own progress, which waits for the arm.

    The run ends with the path, or half a second after it was blocked.
    """

    def __init__(self, follower: PathFollower) -> None:
        self._follower = follower
        self._progress, self._waited = 0.0, 0.0

    def reset(self, q: FloatArray, v: FloatArray, ticks: int) -> None:
        self._follower.reset(q, v)
        self._progress, self._waited = 0.0, 0.0

    def aim(self, k: int, q: FloatArray) -> None:
        """Note the progress; the follower finds the target itself."""
        self._progress = self._follower.progress

    def step(self, q: FloatArray, v: FloatArray, tau: FloatArray | None = None) -> Step:
        step = self._follower.step(q, v, tau=tau)
        self._waited += self._follower.planner.dt if self._follower.status is PathStatus.BLOCKED else 0.0
        return step

    @property
    def target(self) -> Target:
        return self._follower.target

    @property
    def standing(self) -> Standing:
        """Where the follower is; over with the path's end, or once it has been blocked for half a second."""
        follower = self._follower
        return Standing(
            self._progress,
            follower.progress,
            follower.status,
            over=self._progress >= follower.path.duration or self._waited > WAITS,
            finished=follower.status is PathStatus.DONE,
            blocked=follower.blocked,
        )


@final
class GoalLeader(Leader):
    """A motion to a goal, on its own way and in its own time; the run goes on until its time is up."""

    def __init__(self, goto: GoTo) -> None:
        self._goto, self._target, self._time = goto, Target(pose=goto.pose), 0.0

    def reset(self, q: FloatArray, v: FloatArray, ticks: int) -> None:
        self._goto.reset(q, v)
        self._time = 0.0

    def aim(self, k: int, q: FloatArray) -> None:
        """Note the time; the goal stays."""
        self._time = k * self._goto.planner.dt

    def step(self, q: FloatArray, v: FloatArray, tau: FloatArray | None = None) -> Step:
        return self._goto.step(q, v, tau=tau)

    @property
    def target(self) -> Target:
        return self._target

    @property
    def standing(self) -> Standing:
        return Standing(self._time, self._time, finished=self._goto.done)


def leader_along(
    planner: Planner,
    path: Path,
    follower: PathFollower | GoTo | None,
    world: MovingWorld | None,
    *,
    mean: bool,
) -> Leader:
    """What leads an arm along a path, or to a goal."""
    if isinstance(follower, GoTo):
        return GoalLeader(follower)
    if follower is not None:
        return ProgressLeader(follower)
    return ClockLeader(planner, ClockTargets(path, planner.dt, mean=mean), world)


LeaderT = TypeVar("LeaderT", bound=Leader)


class Made(NamedTuple):
    """One tick before the arm moves on."""

    step: Step  # the planner's step
    elapsed: int  # wall time of the step [ns]
    measured: tuple[FloatArray, FloatArray]  # positions and velocities that the planner was given, each (nv,)
    # torques that it was given, and those that the drives asked for, as far as they are known
    felt: tuple[FloatArray | None, FloatArray | None]


@final
class LedArm(Generic[LeaderT]):
    """Target, sensors and step in the order in which they happen; simulations and sessions use it."""

    def __init__(
        self, planner: Planner, leader: LeaderT, plant: Plant, sensors: JointSensors | None = None
    ) -> None:
        self.planner, self.leader, self.plant, self.sensors = planner, leader, plant, sensors

    @property
    def sensed(self) -> tuple[str, ...]:
        """What a log keeps where what is sent, what is measured and what is true may be three."""
        plant, sensors = self.plant, self.sensors
        if sensors is None and plant.drive is None:
            return ()
        feels = sensors is not None and sensors.feels_torque
        known = feels, plant.motors is not None and plant.drive != "torque"
        return (*SENSED, *(name for name, is_known in zip(FELT, known, strict=True) if is_known))

    def reset(self, q: FloatArray, v: FloatArray, ticks: int) -> None:
        """Begin a run of at most so many ticks with a healthy arm at (q, v), each (nv,)."""
        self.leader.reset(q, v, ticks)
        self.plant.reset(q, v)
        if self.sensors is not None:
            self.sensors.reset()

    def plan_step(self, k: int) -> Made:
        """Take aim, measure, and let the planner step; the arm stays where it is until ``plant.advance``."""
        leader, plant, sensors = self.leader, self.plant, self.sensors
        leader.aim(k, plant.q)
        q, v, motors = plant.q, plant.v, plant.motors
        tau, demand = None, None if motors is None else motors.demand
        if sensors is not None:
            sensors.measure(q, v, motors)
            q, v, tau, demand = sensors.q, sensors.v, sensors.tau, sensors.demand
        before = clock.now()
        step = leader.step(q, v, tau)
        elapsed = clock.now() - before
        return Made(step, elapsed, (q, v), (tau, demand))
