"""Staying where it is."""

from typing import Any, ClassVar, final

import numpy as np

from ftqp.control.paths.path import DURATION, Motion, Path
from ftqp.core.checks import FloatArray
from ftqp.core.setting import Settings


@final
class Hold(Path):
    """The tip keeps its start pose: p(t) = p0, R(t) = R0.

    It serves a base that moves, or a joint that fails at rest.

    Args:
        start: The start pose, (4, 4), where the arm stands at time 0.
        duration: How long the pose is held, > 0 [s].
    """

    __slots__ = ()

    settings: ClassVar[Settings] = {"duration": DURATION}

    def __init__(self, start: Any, *, duration: float) -> None:
        super().__init__(start, duration)

    def _motion(self, t: FloatArray) -> Motion:
        still = np.zeros((len(t), 3))
        return Motion(position=still + self.start[:3, 3], velocity=still, acceleration=still)
