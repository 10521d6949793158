"""When the planner stops of its own accord."""

from dataclasses import dataclass

from ftqp.core.checks import positive
from ftqp.core.errors import InputError


@dataclass(frozen=True, slots=True)
class EmergencyStop:
    """Stop when the task error is beyond its threshold and has risen on ``samples`` consecutive ticks.

    Args:
        position: threshold of the position error [m]; 0.01 in Jin et al. 2017, where the arm starts on its
            path. The default leaves room for poses streamed without twists, behind which the tip lags.
        rotation: threshold of the rotation error [rad].
        samples: consecutive rising samples; 1 in Jin et al. 2017, 3 against noise.
    """

    position: float = 0.05
    rotation: float = 0.3
    samples: int = 3

    def __post_init__(self) -> None:
        positive("position", self.position, "m")
        positive("rotation", self.rotation, "rad")
        if not isinstance(self.samples, int) or self.samples < 1:
            raise InputError(f"samples is {self.samples!r}, expected a whole number >= 1")
