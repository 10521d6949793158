"""A Lissajous figure."""

from collections.abc import Mapping
from typing import Any, ClassVar, final

import numpy as np

from ftqp.control.paths import laws
from ftqp.control.paths.axes import AXES, Axis, plane
from ftqp.control.paths.path import DURATION, Motion, Path
from ftqp.core.checks import FloatArray, array
from ftqp.core.errors import InputError
from ftqp.core.setting import Setting, Settings


@final
class Lissajous(Path):
    """p(t) = p0 + A_a (sin(w_a s) a) + A_b (sin(w_b s + d) - sin(d)) b, w = 2 pi n; the orientation is kept.

    Args:
        start: The start pose, (4, 4), where the arm stands at time 0.
        amplitudes: A_a and A_b, (2,), >= 0 and not both 0 [m]. Larger ones make the tip faster in proportion.
        cycles: How often each direction swings, n_a and n_b, (2,), > 0, without unit; whole numbers close the
            figure.
        phase: The phase d of the second direction [rad]; cycles (1, 2) with 0 give the figure eight.
        duration: How long the motion lasts, T, > 0 [s]. A longer one is slower: speeds fall with 1/T and
            accelerations with 1/T^2.
        law: How the way depends on the time: a name, a table, or a ``laws.Law``. Laws that begin and end at
            rest ask for higher peak speeds than ``constant``, which jumps.
        axes: The directions a and b in W, perpendicular to each other.
    """

    __slots__ = ("_basis", "_frequency", "_law", "_phase")

    settings: ClassVar[Settings] = {
        "duration": DURATION,
        "amplitudes": Setting("how far each direction swings, >= 0", unit="m", of=tuple[float, float]),
        "cycles": Setting("how often each direction swings, > 0", of=tuple[float, float]),
        "phase": Setting("phase of the second direction", unit="rad"),
        "axes": AXES,
        "law": laws.LAW,
    }

    def __init__(
        self,
        start: Any,
        amplitudes: Any,
        *,
        duration: float,
        cycles: Any = (1.0, 2.0),
        phase: float = 0.0,
        law: str | Mapping[str, Any] | laws.Law = "quintic",
        axes: tuple[Axis, Axis] = ("x", "y"),
    ) -> None:
        super().__init__(start, duration)
        self._law = laws.by_name(law)
        amplitude = array("amplitudes of the Lissajous figure", amplitudes, (2,))
        if (amplitude < 0.0).any() or not amplitude.any():
            raise InputError(
                f"amplitudes of the Lissajous figure are {amplitude}, expected two lengths >= 0 m, not both 0"
            )
        count = array("cycles of the Lissajous figure", cycles, (2,))
        if (count <= 0.0).any():
            raise InputError(f"cycles of the Lissajous figure are {count}, expected two numbers > 0")
        self._basis = amplitude[:, None] * np.stack(plane(axes))
        self._frequency = 2.0 * np.pi * count
        self._phase = np.array([0.0, float(array("phase of the Lissajous figure", phase, ()))])

    def _motion(self, t: FloatArray) -> Motion:
        s, ds, dds = self._law.sample(t / self.duration)
        angle = np.outer(s, self._frequency) + self._phase
        rate = np.outer(ds / self.duration, self._frequency)
        rate_change = np.outer(dds / self.duration**2, self._frequency)
        sine, cosine = np.sin(angle), np.cos(angle)
        return Motion(
            position=self.start[:3, 3] + (sine - np.sin(self._phase)) @ self._basis,
            velocity=(cosine * rate) @ self._basis,
            acceleration=(cosine * rate_change - sine * rate**2) @ self._basis,
        )
