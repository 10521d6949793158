"""A straight line."""

from collections.abc import Mapping
from typing import Any, ClassVar, final

import numpy as np

from ftqp.control.paths import laws
from ftqp.control.paths.path import DURATION, Motion, Path
from ftqp.core.checks import FloatArray, array
from ftqp.core.errors import InputError
from ftqp.core.setting import Setting, Settings


@final
class Line(Path):
    """p(t) = p0 + s(t/T) d, with the start orientation kept.

    Args:
        start: The start pose, (4, 4), where the arm stands at time 0.
        displacement: The way d from start to end along W's axes, (3,) [m].
        duration: How long the motion lasts, T, > 0 [s]. A longer one is slower: speeds fall with 1/T and
            accelerations with 1/T^2.
        law: How the way depends on the time: a name, a table, or a ``laws.Law``. Laws that begin and end at
            rest ask for higher peak speeds than ``constant``, which jumps.
    """

    __slots__ = ("_displacement", "_law")

    settings: ClassVar[Settings] = {
        "duration": DURATION,
        "displacement": Setting(
            "the way from start to end along W's axes", unit="m", of=tuple[float, float, float]
        ),
        "law": laws.LAW,
    }

    def __init__(
        self,
        start: Any,
        displacement: Any,
        *,
        duration: float,
        law: str | Mapping[str, Any] | laws.Law = "quintic",
    ) -> None:
        super().__init__(start, duration)
        self._law = laws.by_name(law)
        self._displacement = array("displacement of the line", displacement, (3,))
        if not self._displacement.any():
            raise InputError("displacement of the line is zero, expected a way to go [m]")

    def _motion(self, t: FloatArray) -> Motion:
        s, ds, dds = self._law.sample(t / self.duration)
        return Motion(
            position=self.start[:3, 3] + np.outer(s, self._displacement),
            velocity=np.outer(ds / self.duration, self._displacement),
            acceleration=np.outer(dds / self.duration**2, self._displacement),
        )
