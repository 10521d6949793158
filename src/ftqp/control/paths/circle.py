"""A circle."""

from collections.abc import Mapping
from typing import Any, final

import numpy as np

from ftqp.control.paths import laws
from ftqp.control.paths.axes import Axis, plane
from ftqp.control.paths.path import Motion, Path
from ftqp.core.checks import FloatArray, positive


@final
class Circle(Path):
    """p(t) = c + r (cos(phi) a + sin(phi) b), c = p0 - r a, phi = 2 pi n s(t/T), the start orientation kept.

    Args:
        start: start pose, the point of the circle farthest along a, (4, 4).
        radius: r [m].
        duration: T [s].
        law: law of motion of the phase, a name, a table, or a `laws.Law`.
        axes: the directions a and b in W.
        turns: n, how many times round; any positive number [-].

    The phase 2 pi sin^2(pi t / 2T) of the literature on redundant arms is the law ``sine_squared``.
    """

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
