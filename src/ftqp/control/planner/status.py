"""What a step says to the operator."""

from enum import Enum

from ftqp.kernel.layout.enums import Status


class StepStatus(Enum):
    """The status of one step; its value is the sentence for the operator, its position the kernel's code."""

    OK = "the task is followed and every limit is kept"
    RELAXED = (
        "the task cannot be followed exactly within the limits; the arm does the nearest feasible motion"
    )
    SCALED = "the task is followed more slowly, because its full speed would break a limit"
    FALLBACK = "the solver gave no usable answer; a safe substitute command was used for this step"
    STOPPING = "emergency stop: every healthy joint is braking; call reset() to go on"
    STOPPED = "emergency stop: the arm is at rest; call reset() to go on"
    INVALID_INPUT = "the measured state or the target is not finite; the arm brakes until valid values arrive"


STATUSES = tuple(StepStatus[status.name] for status in Status)
"""The statuses in the order of the kernel's codes."""
