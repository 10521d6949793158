"""The rest of a path: how far it can be followed in thought from a posture of the place where it was left."""

from collections.abc import Generator, Iterator, Sequence
from typing import Final, final

import numpy as np

from ftqp.control.inverse_kinematics.posture_search import PostureSearch
from ftqp.control.paths.path import Path
from ftqp.control.planner.planner import Planner
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError

SAMPLES: Final = 200
"""Places of a path at which it is asked whether a posture goes on along it."""
LITTLE, FEWER = 0.01, 20
"""With less than the first share of a path left there are so many, so that arms just out of reach of the end
get their verdict soon."""
AT_ONCE: Final = 4
"""Places of them that are looked at in one tick: some 0.1 ms."""
SLACK: Final = 20.0
"""The path may take so many times its time, because a follower waits where joints are at their speed
limits."""


@final
class PathLookahead:
    """The rest of a path from one of its times on.

    Attributes:
        pose: Where it begins, (4, 4).
        progress: When it begins [s].
        duration: Of the whole path [s].
        is_little: Whether hardly anything of it is left.

    Source: docs/theory/ways-out.md.
    """

    def __init__(self, planner: Planner, path: Path, progress: float) -> None:
        self._planner, self._view = planner, planner.view()
        self.is_little = path.duration - progress <= LITTLE * path.duration
        self._count = FEWER if self.is_little else SAMPLES
        times = np.linspace(progress, path.duration, self._count + 1)
        self._path, self.progress, self.duration = path, progress, path.duration
        self._poses = path.sample(times).pose
        self._gap = float(times[1] - times[0])
        self.pose: FloatArray = self._poses[0]
        self._search: PostureSearch | None = None
        self._passable = planner.passable()
        self._room = 0.0

    def begin(self, rows: str | None = None) -> PostureSearch | None:
        """A search with the arm, limits and failures as believed now; None for arms that have none."""
        planner, view = self._planner, self._view
        self._search = None
        if planner.robot.chain.floating or not planner.robot.is_serial:
            return None
        try:
            search = PostureSearch(
                planner.robot, self.pose, planner.kept_rows if rows is None else rows, planner.task.axis
            )
        except InputError:
            return None
        limits = view.limits
        if self._passable.looks_around:
            self._room = min(0.0, float(self._passable.room(view.command.q[None])[0]))
        search.begin(view.command.q, working=view.working, q_min=limits.q_min, q_max=limits.q_max)
        self._search = search
        return search

    def along(
        self, q: FloatArray, begin: float, end: float, longest: float
    ) -> Generator[None, None, FloatArray | None]:
        """The postures that follow the path from one of its times to another, (k, nv); None where it ends."""
        assert self._search is not None
        gap = max(self._gap, self.duration / SAMPLES)
        times = np.linspace(begin, end, int(np.ceil(abs(end - begin) / gap - 1e-9)) + 1)[1:]
        gone = [q]
        for k, pose in enumerate(self._path.sample(times).pose if len(times) else ()):
            nearest = self._search.along(gone[-1], pose)
            if nearest is None or np.abs(nearest - gone[-1]).max() > longest:
                return None
            gone.append(nearest)
            if k % AT_ONCE == AT_ONCE - 1:
                yield
        return np.array(gone[1:]).reshape(-1, len(q))

    def near(self, q: FloatArray) -> Iterator[tuple[FloatArray, float, bool]]:
        """Postures that follow the rest of the path as nearly as they can, its times, and whether they do."""
        assert self._search is not None
        for k in range(1, len(self._poses)):
            q, there = self._search.nearest(q, self._poses[k])
            yield q, self.progress + k * self._gap, there and self._is_clear([q])

    def reached(
        self, q: FloatArray, search: PostureSearch | None = None, time: float | None = None
    ) -> Generator[None, None, float]:
        """The share of the rest of the path along which the joints can follow it from a posture.

        Newton steps go from place to place, within the limits and clear of what the planner keeps clear of.
        """
        search = self._search if search is None else search
        assert search is not None
        most, working = SLACK * self._gap * self._view.limits.v, self._view.working
        first = 0 if time is None else round((time - self.progress) / self._gap)
        gone: list[FloatArray] = []
        for k in range(first + 1, len(self._poses)):
            nearest = search.along(q, self._poses[k])
            if nearest is None or (np.abs(nearest - q) > most)[working].any():
                return (k - 1 - (0 if self._is_clear(gone) else len(gone))) / self._count
            q = nearest
            gone.append(q)
            if k % AT_ONCE == 0:
                if not self._is_clear(gone):
                    return (k - len(gone)) / self._count
                gone.clear()
                yield
        return 1.0 if self._is_clear(gone) else 1.0 - len(gone) / self._count

    def _is_clear(self, places: Sequence[FloatArray]) -> bool:
        """Whether the arm meets nothing at some places, nor leaves what it is kept in."""
        if not places or not self._passable.looks_around:
            return True
        return bool((self._passable.room(np.array(places)) >= self._room).all())
