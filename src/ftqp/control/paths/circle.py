"""A circle."""

from collections.abc import Mapping
from typing import Any, ClassVar, final

import numpy as np

from ftqp.control.paths import laws
from ftqp.control.paths.axes import AXES, Axis, plane
from ftqp.control.paths.path import DURATION, Motion, Path
from ftqp.core.checks import FloatArray, positive
from ftqp.core.setting import Setting, Settings


@final
class Circle(Path):
    """p(t) = c + r (cos(phi) a + sin(phi) b), c = p0 - r a, phi = 2 pi n s(t/T), the start orientation kept.

    The phase 2 pi sin^2(pi t / 2T) of the literature on redundant arms is the law ``sine_squared``.

    Args:
        start: The start pose, (4, 4), the point of the circle farthest along a.
        radius: The radius r, > 0 [m]. A larger one makes the tip faster in proportion.
        duration: How long the motion lasts, T, > 0 [s]. A longer one is slower: speeds fall with 1/T and
            accelerations with 1/T^2.
        law: How the way depends on the time: a name, a table, or a ``laws.Law``. Laws that begin and end at
            rest ask for higher peak speeds than ``constant``, which jumps.
        axes: The directions a and b in W, perpendicular to each other.
        turns: How many times round, n, > 0, without unit; it need not be whole.
    """

    __slots__ = ("_angle", "_basis", "_law")

    settings: ClassVar[Settings] = {
        "duration": DURATION,
        "radius": Setting("radius, > 0", unit="m", above=0.0),
        "axes": AXES,
        "turns": Setting("how many times round, > 0, at most 1e6", above=0.0, most=1e6),
        "law": laws.LAW,
    }

    def __init__(
        self,
        start: Any,
        radius: float,
        *,
        duration: float,
        law: str | Mapping[str, Any] | laws.Law = "quintic",
        axes: tuple[Axis, Axis] = ("x", "y"),
        turns: float = 1.0,
    ) -> None:
        super().__init__(start, duration)
        self._law = laws.by_name(law)
        self._basis = positive("radius of the circle", radius, "m") * np.stack(plane(axes))
        self._angle = 2.0 * np.pi * positive("turns of the circle", turns)

    def _motion(self, t: FloatArray) -> Motion:
        s, ds, dds = self._law.sample(t / self.duration)
        phase = self._angle * s
        rate = (self._angle / self.duration * ds)[:, None]
        rate_change = (self._angle / self.duration**2 * dds)[:, None]
        outward = np.stack([np.cos(phase), np.sin(phase)], axis=1)
        along = np.stack([-np.sin(phase), np.cos(phase)], axis=1)
        return Motion(
            position=self.start[:3, 3] + (outward - np.array([1.0, 0.0])) @ self._basis,
            velocity=(rate * along) @ self._basis,
            acceleration=(rate_change * along - rate**2 * outward) @ self._basis,
        )
