"""What is measured of a pose: noise and delay."""

from typing import final

import numpy as np

from ftqp.core.checks import FloatArray, non_negative
from ftqp.core.pose import rotation_exp


@final
class PoseSensor:
    """Measures a pose in I with white noise, some samples late.

    Args:
        position: standard deviation of each axis [m].
        rotation: standard deviation about each axis [rad].
        late: samples of delay.
        generator: where the noise comes from.
    """

    def __init__(
        self,
        *,
        position: float = 0.0,
        rotation: float = 0.0,
        late: int = 0,
        generator: np.random.Generator | None = None,
    ) -> None:
        self._position = non_negative("position noise", position, "m")
        self._rotation = non_negative("rotation noise", rotation, "rad")
        self._generator = np.random.default_rng(0) if generator is None else generator
        self._waiting: list[FloatArray] = []
        self._late = int(non_negative("delay of the sensor", late))

    def reset(self) -> None:
        """Forget what has been seen."""
        self._waiting.clear()

    def measure(self, truth: FloatArray) -> FloatArray:
        """The pose that is measured now, (4, 4); until something has come through the delay, the first one.

        Args:
            truth: The true pose, (4, 4) [m].
        """
        seen = truth.copy()
        if self._position > 0.0:
            seen[:3, 3] += self._position * self._generator.standard_normal(3)
        if self._rotation > 0.0:
            noise = rotation_exp(self._rotation * self._generator.standard_normal(3))
            seen[:3, :3] = noise @ seen[:3, :3]
        self._waiting.append(seen)
        if len(self._waiting) > self._late + 1:
            self._waiting.pop(0)
        return self._waiting[0]
