"""What leads an arm along its path: the clock, the path's own progress, or a task in inertial space."""

from abc import ABC, abstractmethod
from typing import final

import numpy as np

from ftqp.control.following.path_follower import PathFollower, PathStatus
from ftqp.control.paths import Path, mean_acceleration
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.step import Step
from ftqp.control.planner.target import Target, Targets
from ftqp.core.checks import FloatArray
from ftqp.sim.base.moving_world import MovingWorld
from ftqp.sim.plants.arm_model import Arm

SAMPLED = 2048
"""Ticks whose targets are sampled together."""
WAITS = 0.5
"""How long the arm is watched after its path was blocked [s]."""


class Leader(ABC):
    """The role of what leads an arm: at every tick it takes aim, then gives the command."""

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

    @abstractmethod
    def tip(self, q: FloatArray) -> FloatArray:
        """True pose of the tip at this tick in the frame of the target, (4, 4); valid until the next call."""

    @property
    @abstractmethod
    def progress(self) -> float:
        """Path time of the target of the last step [s]."""

    @property
    @abstractmethod
    def reached(self) -> float:
        """Path time that has been reached [s]."""

    @property
    @abstractmethod
    def path_status(self) -> PathStatus | None:
        """Where the path stands; None where it has no progress of its own."""

    @property
    @abstractmethod
    def over(self) -> bool:
        """Whether the run ends with the last step, before its time is up."""

    @property
    @abstractmethod
    def finished(self) -> bool:
        """Whether nothing of the path is left once all ticks are done."""

    @property
    @abstractmethod
    def blocked(self) -> str | None:
        """Why the path does not go on, or None."""

    @property
    @abstractmethod
    def world(self) -> MovingWorld | None:
        """The base under the arm where it moves."""


@final
class ClockTargets:
    """The targets of a path at the ticks of a clock, sampled block by block.

    Args:
        path: what is followed.
        dt: sampling period [s].
        mean: feed forward the mean acceleration over dt in place of that at the tick.

    Attributes:
        target: that of the last tick asked for.
        progress: its path time [s].
    """

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

    def packed(self, k: int, count: int) -> tuple[FloatArray, FloatArray]:
        """Targets of the ticks from k on that are sampled, at most ``count``, (K, 29), and their times."""
        if not self._first <= k < self._first + SAMPLED:
            self._sample(k)
        at = k - self._first
        end = min(at + count, len(self._pose))
        targets = Targets(self._pose[at:end], self._twist[at:end], self._acceleration[at:end])
        times = np.minimum(np.arange(k, k + end - at) * self._dt, self._path.duration)
        return targets.packed, times

    def _sample(self, first: int) -> None:
        """Poses, twists and accelerations of the next ticks."""
        t = np.arange(first, min(first + SAMPLED, max(self._ticks, first + 1))) * self._dt
        sample = self._path.sample(t)
        self._first, self._pose, self._twist = first, sample.pose, sample.twist
        self._acceleration = mean_acceleration(self._path, t, self._dt) if self._mean else sample.acceleration


class ClockedLeader(Leader):
    """What goes by the clock: the path is at k dt at tick k, whatever the arm does.

    Args:
        targets: of its path.
    """

    def __init__(self, targets: ClockTargets) -> None:
        self._targets = targets

    @property
    def target(self) -> Target:
        """What the last step aimed at, in the frame of the path."""
        return self._targets.target

    @property
    def progress(self) -> float:
        """Path time of the target [s]."""
        return self._targets.progress

    @property
    def reached(self) -> float:
        """Path time that the clock has reached [s]."""
        return self._targets.progress

    @property
    def path_status(self) -> None:
        """The path has no progress of its own."""
        return None

    @property
    def over(self) -> bool:
        """Never before the time is up."""
        return False

    @property
    def finished(self) -> bool:
        """Always, once all ticks are done."""
        return True

    @property
    def blocked(self) -> None:
        """Nothing blocks a clock."""
        return None


@final
class ClockLeader(ClockedLeader):
    """The clock: tick k aims at the path at k dt, whatever the arm does.

    Args:
        planner: gives the commands.
        targets: of its path.
    """

    def __init__(self, planner: Planner, targets: ClockTargets) -> None:
        super().__init__(targets)
        self._planner = planner
        self._arm = Arm(planner.robot)

    @property
    def targets(self) -> ClockTargets:
        """What the clock aims at."""
        return self._targets

    def reset(self, q: FloatArray, v: FloatArray, ticks: int) -> None:
        """Begin a run of so many ticks at (q, v), each (nv,)."""
        self._planner.reset(q, v)
        self._targets.reset(ticks)

    def aim(self, k: int, q: FloatArray) -> None:
        """Find the target of tick k."""
        self._targets.aim(k)

    def step(self, q: FloatArray, v: FloatArray, tau: FloatArray | None = None) -> Step:
        """The planner's command at the measured state (q, v) and torques, each (nv,)."""
        return self._planner.step(q, v, self._targets.target, tau=tau)

    def tip(self, q: FloatArray) -> FloatArray:
        """Pose of the tip in W at q, (4, 4)."""
        return self._arm.tip(q)

    @property
    def world(self) -> None:
        """The base stands."""
        return None


@final
class ProgressLeader(Leader):
    """The path's own progress, which waits for the arm.

    The run ends with the path, or half a second after it was blocked.

    Args:
        follower: gives the commands.
    """

    def __init__(self, follower: PathFollower) -> None:
        self._follower = follower
        self._arm = Arm(follower.planner.robot)
        self._progress, self._waited = 0.0, 0.0

    def reset(self, q: FloatArray, v: FloatArray, ticks: int) -> None:
        """Begin the path anew at (q, v), each (nv,)."""
        self._follower.reset(q, v)
        self._progress, self._waited = 0.0, 0.0

    def aim(self, k: int, q: FloatArray) -> None:
        """Note the progress; the follower finds the target itself."""
        self._progress = self._follower.progress

    def step(self, q: FloatArray, v: FloatArray, tau: FloatArray | None = None) -> Step:
        """The follower's command at the measured state (q, v) and torques, each (nv,)."""
        step = self._follower.step(q, v, tau=tau)
        self._waited += self._follower.planner.dt if self._follower.status is PathStatus.BLOCKED else 0.0
        return step

    @property
    def target(self) -> Target:
        """What the last step aimed at, in W."""
        return self._follower.target

    def tip(self, q: FloatArray) -> FloatArray:
        """Pose of the tip in W at q, (4, 4)."""
        return self._arm.tip(q)

    @property
    def progress(self) -> float:
        """Path time of the target [s]."""
        return self._progress

    @property
    def reached(self) -> float:
        """Path time that has been reached [s]."""
        return self._follower.progress

    @property
    def path_status(self) -> PathStatus:
        """Where the path stands."""
        return self._follower.status

    @property
    def over(self) -> bool:
        """Whether the path's end was aimed at, or it has been blocked for half a second."""
        return self._progress >= self._follower.path.duration or self._waited > WAITS

    @property
    def finished(self) -> bool:
        """Whether the path is done."""
        return self._follower.status is PathStatus.DONE

    @property
    def blocked(self) -> str | None:
        """Why the path does not go on, or None."""
        return self._follower.blocked

    @property
    def world(self) -> None:
        """The base stands."""
        return None


@final
class InertialLeader(ClockedLeader):
    """A task in inertial space, by the clock, on a base that moves.

    Args:
        world: the base, its sensors and the inertial task.
        targets: of a path in the inertial frame.
    """

    def __init__(self, world: MovingWorld, targets: ClockTargets) -> None:
        super().__init__(targets)
        self._world = world

    def reset(self, q: FloatArray, v: FloatArray, ticks: int) -> None:
        """Begin a run of so many ticks at (q, v), each (nv,)."""
        self._world.reset(q, v, ticks)
        self._targets.reset(ticks)

    def aim(self, k: int, q: FloatArray) -> None:
        """Find the target of tick k and take its measurements; q is true, (nv,)."""
        self._targets.aim(k)
        self._world.sense(k, q)

    def step(self, q: FloatArray, v: FloatArray, tau: FloatArray | None = None) -> Step:
        """The inertial task's command at the measured state (q, v), each (nv,); it takes no torques."""
        return self._world.step(q, v, self._targets.target)

    def tip(self, q: FloatArray) -> FloatArray:
        """True pose of the tip in I at the tick of the last measurements, (4, 4)."""
        return self._world.tip_pose

    @property
    def world(self) -> MovingWorld:
        """The base, its sensors and the inertial task."""
        return self._world


def leader_along(
    planner: Planner, path: Path, follower: PathFollower | None, world: MovingWorld | None, *, mean: bool
) -> Leader:
    """What leads an arm along a path.

    Args:
        planner: gives the commands.
        path: what is followed.
        follower: leads the planner by the path's progress; None goes by the clock.
        world: the base, where it moves.
        mean: by the clock, feed forward the mean acceleration over dt in place of that at the tick.
    """
    if follower is not None:
        return ProgressLeader(follower)
    targets = ClockTargets(path, planner.dt, mean=mean)
    return ClockLeader(planner, targets) if world is None else InertialLeader(world, targets)
