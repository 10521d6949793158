"""What a path is: a pose, a twist and an acceleration for every time; and paths repeated and backwards."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, final

import numpy as np

from ftqp.core.checks import FloatArray, frozen, positive
from ftqp.core.errors import InputError
from ftqp.core.pose import pose
from ftqp.core.setting import Setting, Settings
from ftqp.core.small_picture import curves_svg, html_table
from ftqp.kernel.layout.thresholds import TIME_SLACK

DRAWN = 401
"""Samples of a path from which a notebook's table is made. A convention."""
LONGEST = 1e9
"""A path takes at most that long, thirty years [s], so that ticks can be counted exactly: 1e15 of the
shortest ones are fewer than 2^53."""


DURATION = Setting("how long the motion lasts, > 0", unit="s", above=0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class PathSample:
    """A path at K times.

    Attributes:
        pose: The desired pose of E in W, (K, 4, 4) [m].
        twist: Its linear then angular velocity at E's origin along W's axes, (K, 6) [m/s, rad/s].
        acceleration: The time derivative of the twist, (K, 6) [m/s2, rad/s2].
    """

    pose: FloatArray
    twist: FloatArray
    acceleration: FloatArray

    def __repr__(self) -> str:
        return f"PathSample({len(self.pose)} poses, twists and accelerations)"


class Motion(NamedTuple):
    """What a kind of path says about its times: position and rotation with two derivatives.

    Attributes:
        position: (K, 3) [m].
        velocity: (K, 3) [m/s].
        acceleration: (K, 3) [m/s2].
        rotation: (K, 3, 3), or ``None`` where the start orientation is kept.
        angular_velocity: (K, 3) along W's axes [rad/s], or ``None``.
        angular_acceleration: (K, 3) along W's axes [rad/s2], or ``None``.
    """

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    rotation: FloatArray | None = None
    angular_velocity: FloatArray | None = None
    angular_acceleration: FloatArray | None = None


class Path(ABC):
    """The role of a path: it starts exactly at its start pose, lasts its duration, then rests at its end.

    Args:
        start: The pose of E in W at time 0, (4, 4) or anything with ``.homogeneous``.
        duration: How long the motion lasts, > 1e-9 and at most 1e9 [s].

    Attributes:
        settings: What a file may say of a path of this kind, by argument.
    """

    __slots__ = ("_duration", "_start")

    settings: ClassVar[Settings]

    def __init__(self, start: Any, duration: float) -> None:
        self._start: FloatArray = frozen(pose(start, "start pose of the path"))
        self._duration = positive("duration of the path", duration, "s")
        if self._duration > LONGEST:
            raise InputError(f"duration of the path is {self._duration:g} s, expected at most {LONGEST:g} s")
        if self._duration <= TIME_SLACK:  # all its times would count as equal
            raise InputError(
                f"duration of the path is {self._duration:g} s, expected more than {TIME_SLACK:g} s"
            )

    def _about(self, at: PathSample) -> dict[str, str]:
        """Where it begins, how long and how fast it is."""
        speed, turn = np.linalg.norm(at.twist[:, :3], axis=1), np.linalg.norm(at.twist[:, 3:], axis=1)
        length = float(np.linalg.norm(np.diff(at.pose[:, :3, 3], axis=0), axis=1).sum())
        return {
            "begins at": ", ".join(f"{x:.4g}" for x in self._start[:3, 3].round(6) + 0.0) + " m",
            "lasts": f"{self._duration:g} s",
            "is long": f"{length:.4g} m",
            "is at most as fast as": f"{speed.max():.3g} m/s",
            "turns at most": f"{turn.max():.3g} rad/s",
        }

    @final
    def __repr__(self) -> str:
        about = self._about(self.sample(np.linspace(0.0, self._duration, DRAWN)))
        return f"{type(self).__name__}({', '.join(f'{what} {how}' for what, how in about.items())})"

    @final
    def _repr_html_(self) -> str:
        """The same as a table with a picture, for notebooks."""
        at = self.sample(np.linspace(0.0, self._duration, DRAWN))
        rows = list(self._about(at).items())
        tip = at.pose[:, :3, 3]
        across, up = np.sort(np.argsort(np.ptp(tip, axis=0), kind="stable")[1:])
        says = f"the end effector's way, {'xyz'[across]} to the right and {'xyz'[up]} up"
        picture = curves_svg([(tip[:, across], tip[:, up])], says, true_to_scale=True)
        return html_table(type(self).__name__, (), rows, picture=picture)

    @final
    @property
    def start(self) -> FloatArray:
        """Pose at time 0, (4, 4), read-only."""
        return self._start

    @final
    @property
    def duration(self) -> float:
        """How long the motion lasts [s]."""
        return self._duration

    @final
    def sample(self, t: Any) -> PathSample:
        """The path at the times ``t``: what holds from each time on, so the right-hand side of a jump.

        Args:
            t: Times, (K,) or one number [s]; before 0 the path waits at its start, later at its end.

        Raises:
            InputError: A time is not a finite number.
        """
        times = np.atleast_1d(np.asarray(t, dtype=np.float64))
        if times.ndim != 1 or not np.isfinite(times).all():
            raise InputError(f"t has shape {times.shape}, expected finite times of shape (K,)")
        times = np.where(times >= self._duration - TIME_SLACK, self._duration, times)
        times = np.where(times <= TIME_SLACK, np.where(times < -TIME_SLACK, -1.0, 0.0), times)
        motion = self._motion(np.maximum(times, 0.0))
        count = len(times)
        result = PathSample(
            pose=np.tile(self._start, (count, 1, 1)),
            twist=np.zeros((count, 6)),
            acceleration=np.zeros((count, 6)),
        )
        inside = times > 0.0
        result.pose[inside, :3, 3] = motion.position[inside]
        moving = (times >= 0.0) & (times < self._duration)
        result.twist[moving, :3] = motion.velocity[moving]
        result.acceleration[moving, :3] = motion.acceleration[moving]
        if motion.rotation is not None:
            result.pose[inside, :3, :3] = motion.rotation[inside]
        if motion.angular_velocity is not None and motion.angular_acceleration is not None:
            result.twist[moving, 3:] = motion.angular_velocity[moving]
            result.acceleration[moving, 3:] = motion.angular_acceleration[moving]
        return result

    @abstractmethod
    def _motion(self, t: FloatArray) -> Motion:
        """The motion at times t, (K,), all within [0, duration]."""


def mean_acceleration(path: Path, t: Any, dt: float) -> FloatArray:
    """The acceleration that, held for dt, takes the twist at t to the twist at t + dt, (K, 6).

        a = (V(t + dt) - V(t)) / dt

    Fed forward in place of the acceleration at t, it removes the bias dt/2 of a sampled and held command.

    Args:
        path: The path.
        t: Times, (K,) [s].
        dt: How long the command is held, > 0 [s].
    """
    dt = positive("dt", dt, "s")
    times = np.atleast_1d(np.asarray(t, dtype=np.float64))
    mean: FloatArray = (path.sample(times + dt).twist - path.sample(times).twist) / dt
    return mean


CLOSED = 1e-9
"""A path whose end is so near to its start is closed [m, and entries of the rotation]. The tolerance of a
path's own table, so that repeats join without a jump that shows."""


@final
class Repeated(Path):
    """A path repeated for as long as asked; before its end the first lap is the path itself, bit by bit.

    A closed path of duration T is at t where it was at t mod T. One that is not closed is followed to its end
    and back: at t in (T, 2T] it is where it was at 2T - t and moves the other way.

    Attributes:
        lap: How long a lap takes [s].
        closed: Whether the path ends where it begins.
    """

    __slots__ = ("_path", "closed", "lap")

    def __init__(self, path: Path, laps: float) -> None:
        self.closed = is_closed(path)
        self.lap = path.duration * (1.0 if self.closed else 2.0)
        super().__init__(path.start, laps * self.lap)
        self._path = path

    def _motion(self, t: FloatArray) -> Motion:
        within = np.mod(t, self.lap)
        within = np.where(within > self.lap - TIME_SLACK, 0.0, within)
        back = within > self._path.duration
        sample = self._path.sample(np.where(back, self.lap - within, within))
        return _motion_of(sample, np.where(back[:, None], -sample.twist, sample.twist))


@final
class Backwards(Path):
    """A path from its end to its start, through the same poses in the same time."""

    __slots__ = ("_path",)

    def __init__(self, path: Path) -> None:
        super().__init__(path.sample(path.duration).pose[0], path.duration)
        self._path = path

    def _motion(self, t: FloatArray) -> Motion:
        sample = self._path.sample(self.duration - t)
        return _motion_of(sample, -sample.twist)


def _motion_of(sample: PathSample, twist: FloatArray) -> Motion:
    """The motion of a sample with another twist."""
    pose, change = sample.pose, sample.acceleration
    return Motion(pose[:, :3, 3], twist[:, :3], change[:, :3], pose[:, :3, :3], twist[:, 3:], change[:, 3:])


def is_closed(path: Path) -> bool:
    """Whether a path ends where it begins."""
    end = path.sample(path.duration).pose[0]
    return bool(np.abs(end - path.start).max() <= CLOSED)
