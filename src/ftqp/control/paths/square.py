"""A square, each side from rest to rest."""

from collections.abc import Mapping
from typing import Any, ClassVar, final

import numpy as np

from ftqp.control.paths import laws
from ftqp.control.paths.axes import AXES, Axis, plane
from ftqp.control.paths.path import DURATION, TIME_SLACK, Motion, Path
from ftqp.core.checks import FloatArray, positive
from ftqp.core.setting import Setting, Settings

_SIDES = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


@final
class Square(Path):
    """p(t) = P_k + s(u) (P_{k+1} - P_k) with the sides in the order +a, +b, -a, -b, a quarter of T each.

    Args:
        start: The start pose and first corner, (4, 4).
        side: The length of a side, > 0 [m]. A longer one makes the tip faster in proportion.
        duration: How long all four sides take, T, > 0 [s]. A longer one is slower.
        law: How the way along each side depends on the time: a name, a table, or a ``laws.Law``. Laws that
            begin and end at rest ask for higher peak speeds than ``constant``, which jumps.
        axes: The directions a and b in W, perpendicular to each other.

    Source: the square task of Jin et al. 2017, with each side at rest at its corners
    (``docs/evidence/jin2017.md``).
    """

    __slots__ = ("_basis", "_law")

    settings: ClassVar[Settings] = {
        "duration": DURATION,
        "side": Setting("length of a side, > 0", unit="m", above=0.0),
        "axes": AXES,
        "law": laws.LAW,
    }

    def __init__(
        self,
        start: Any,
        side: float,
        *,
        duration: float,
        law: str | Mapping[str, Any] | laws.Law = "quintic",
        axes: tuple[Axis, Axis] = ("x", "y"),
    ) -> None:
        super().__init__(start, duration)
        self._law = laws.by_name(law)
        self._basis = positive("side of the square", side, "m") * np.stack(plane(axes))

    def _motion(self, t: FloatArray) -> Motion:
        quarter = 0.25 * self.duration
        index = np.minimum(np.floor((t + TIME_SLACK) / quarter), 3.0)
        u = np.maximum(t / quarter - index, 0.0)
        u[t >= self.duration] = 1.0
        k = index.astype(np.int64)
        s, ds, dds = self._law.sample(u)
        direction = _SIDES[k] @ self._basis
        way = _CORNERS[k] + s[:, None] * _SIDES[k]
        return Motion(
            position=self.start[:3, 3] + way @ self._basis,
            velocity=(ds / quarter)[:, None] * direction,
            acceleration=(dds / quarter**2)[:, None] * direction,
        )
