"""Straight to a goal pose."""

from collections.abc import Mapping
from typing import Any, final

import numpy as np

from ftqp.control.paths import laws
from ftqp.control.paths.path import Motion, Path
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.core.pose import pose


@final
class PointToPoint(Path):
    """p(t) = p0 + s (p1 - p0), R(t) = R0 exp(s log(R0' R1)): straight line, rotation about one fixed axis.

    Half a turn has two shortest ways; one of them is taken.

    Args:
        start: The start pose, (4, 4), where the arm stands at time 0.
        goal: The end pose, (4, 4), another than the start.
        duration: How long the motion lasts, T, > 0 [s]. A longer one is slower: speeds fall with 1/T and
            accelerations with 1/T^2.
        law: How the way depends on the time: a name, a table, or a ``laws.Law``. Laws that begin and end at
            rest ask for higher peak speeds than ``constant``, which jumps.
    """

    __slots__ = ("_displacement", "_first", "_law", "_turn")

    def __init__(
        self,
        start: Any,
        goal: Any,
        *,
        duration: float,
        law: str | Mapping[str, Any] | laws.Law = "quintic",
    ) -> None:
        from scipy.spatial.transform import Rotation  # slow to load, needed for such a path only

        super().__init__(start, duration)
        self._law = laws.by_name(law)
        end = pose(goal, "goal pose")
        self._displacement = end[:3, 3] - self.start[:3, 3]
        self._first = Rotation.from_matrix(self.start[:3, :3])
        self._turn = (self._first.inv() * Rotation.from_matrix(end[:3, :3])).as_rotvec()
        if not self._displacement.any() and not self._turn.any():
            raise InputError("goal pose equals the start pose, expected somewhere to go")

    def _motion(self, t: FloatArray) -> Motion:
        from scipy.spatial.transform import Rotation

        s, ds, dds = self._law.sample(t / self.duration)
        rate, rate_change = ds / self.duration, dds / self.duration**2
        axis = self._first.apply(self._turn)
        return Motion(
            position=self.start[:3, 3] + np.outer(s, self._displacement),
            velocity=np.outer(rate, self._displacement),
            acceleration=np.outer(rate_change, self._displacement),
            rotation=(self._first * Rotation.from_rotvec(np.outer(s, self._turn))).as_matrix(),
            angular_velocity=np.outer(rate, axis),
            angular_acceleration=np.outer(rate_change, axis),
        )
