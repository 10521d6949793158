"""A path again and again, round and round where it is closed, else there and back; and a path backwards."""

from typing import final

import numpy as np

from ftqp.control.paths.path import Motion, Path, PathSample
from ftqp.core.checks import FloatArray
from ftqp.kernel.layout.thresholds import TIME_SLACK

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
