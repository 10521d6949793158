"""The rest of a path: how far it can be followed in thought from a posture of the place where it was left."""

from collections.abc import Generator
from typing import Final, final

import numpy as np

from ftqp.control.inverse_kinematics.posture_search import PostureSearch
from ftqp.control.paths.path import Path
from ftqp.control.planner.planner import Planner
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError

SAMPLES: Final = 200
"""Places of a path at which it is asked whether a posture goes on along it."""
AT_ONCE: Final = 4
"""Places of them that are looked at in one tick: some 0.1 ms."""
SLACK: Final = 20.0
"""The path may take so many times its time, because a follower waits where joints are at their speed limits.
A guess that `python benchmarks/bench_bridges.py` has not contradicted."""


@final
class Ahead:
    """The rest of a path from one of its times on.

    Args:
        planner: The planner that is led.
        path: Its path.
        progress: The path time from which on it is looked at [s].

    Attributes:
        pose: Where it begins, (4, 4).

    Source: docs/theory/ways-out.md.
    """

    def __init__(self, planner: Planner, path: Path, progress: float) -> None:
        self._planner, self._view = planner, planner.view()
        times = np.linspace(progress, path.duration, SAMPLES + 1)
        self._poses = path.sample(times).pose
        self._gap = float(times[1] - times[0])
        self.pose: FloatArray = self._poses[0]
        self._search: PostureSearch | None = None

    def begin(self) -> PostureSearch | None:
        """A search with the arm, limits and failures as believed now; None for arms that have none."""
        planner, view = self._planner, self._view
        self._search = None
        if planner.robot.chain.floating or not planner.robot.is_serial:
            return None
        try:
            search = PostureSearch(planner.robot, self.pose, planner.kept_rows, planner.task.axis)
        except InputError:
            return None
        limits = view.limits
        search.begin(view.command.q, working=view.working, q_min=limits.q_min, q_max=limits.q_max)
        self._search = search
        return search

    def reached(self, q: FloatArray, search: PostureSearch | None = None) -> Generator[None, None, float]:
        """The share of the rest of the path along which the joints can follow it from a posture.

        Newton steps go from place to place, within the limits.

        Args:
            q: The posture, (nv,) [rad or m].
            search: Whose Newton steps; None takes those of ``begin``.
        """
        search = self._search if search is None else search
        assert search is not None
        limits, working = self._view.limits, self._view.working
        most = SLACK * self._gap * limits.v
        for k in range(1, len(self._poses)):
            nearest = search.along(q, self._poses[k])
            if nearest is None or (np.abs(nearest - q) > most)[working].any():
                return (k - 1) / SAMPLES
            q = nearest
            if k % AT_ONCE == 0:
                yield
        return 1.0
