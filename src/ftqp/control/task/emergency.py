"""When the planner stops of its own accord."""

from dataclasses import dataclass

from ftqp.core.setting import refuse_out_of_range, setting


@dataclass(frozen=True, slots=True)
class EmergencyStop:
    """The planner stops when the task error is too large and has risen on ``samples`` consecutive ticks.

    Args:
        position: The position error beyond which a rising error counts, > 0 [m]. A larger one stops later;
            Jin et al. 2017 take 0.01, where the arm starts on its path. The default leaves room for poses
            streamed without twists, behind which the tip lags.
        rotation: The rotation error beyond which a rising error counts, > 0 [rad]. A larger one stops later.
        samples: How many ticks in a row the error has to rise, >= 1. One stops at the first rise, as in Jin
            et al. 2017; more are calmer against noise and later by as many ticks.

    Raises:
        InputError: A threshold is not positive, or ``samples`` is not a whole number from 1.
    """

    position: float = setting(0.05, "threshold of the position error, > 0", unit="m", above=0.0)
    rotation: float = setting(0.3, "threshold of the rotation error, > 0", unit="rad", above=0.0)
    samples: int = setting(3, "rising samples in a row, >= 1", least=1.0)

    def __post_init__(self) -> None:
        refuse_out_of_range(self)
