"""What a step says to the operator."""

from enum import Enum
from typing import Final

from ftqp.kernel.layout.enums import Status, StopReason


class StepStatus(Enum):
    """The status of one step; its value is the sentence for the operator, its position the kernel's code."""

    OK = "the task is followed and every limit is kept"
    RELAXED = (
        "the task cannot be followed exactly within the limits, or a joint is outside them; the arm does the "
        "nearest feasible motion"
    )
    SCALED = "the task is followed more slowly, because its full speed would break a limit"
    LAGGING = (
        "the arm is farther from its task than the tolerance, or a joint from its command than its drive "
        "explains, and the path waits for it; or a joint is measured beyond its range"
    )
    FALLBACK = "the solver gave no usable answer; a safe substitute command was used for this step"
    STOPPING = "stop: every healthy joint is braking; call resume() or reset() to go on"
    STOPPED = "stop: the arm is at rest and holds its place; call resume() or reset() to go on"
    INVALID_INPUT = (
        "a measurement or the target is impossible and is not used; the arm goes on without the measurement "
        "for a moment, and stands still until the target is a possible one"
    )
    HELD = (
        "the whole arm is held, as by a protective stop; the planner waits, and goes on when it is released"
    )


STATUSES = tuple(StepStatus[status.name] for status in Status)
"""The statuses in the order of the kernel's codes."""

STOP_REASONS: Final[dict[StopReason, str | None]] = {
    StopReason.NONE: None,
    StopReason.ASKED: "stop() was called",
    StopReason.ERROR: "the task error was beyond its threshold and rose",
    StopReason.FALLBACKS: "no usable command was found for too long",
    StopReason.SENSOR: (
        "the sensor of {joint} gave impossible samples for too long; call reset() once it is mended"
    ),
    StopReason.DEVIATION: (
        "the end effector is too far from where it was sent; {joint} is farthest from its command"
    ),
    StopReason.LAG: "the arm does not follow: {joint} is farthest from its command",
    StopReason.FREE_JOINT: "a joint swings freely, and nothing of the task can be kept",
    StopReason.OVERLOAD: "{joint} cannot hold the arm here with the torque that it has left",
    StopReason.SECOND_FREE: (
        "{joint} seems to swing freely next to a joint that failed before, which only you can confirm: "
        "report it, or call resume() if it works"
    ),
    StopReason.SCENE: (
        "something stands in the scene that no body of the arm is watched against; the scene was changed in "
        "another thread, or while a step was under way"
    ),
    StopReason.CLEARANCE: "{pair} were nearer than Clearance(stop=...) and still came nearer",
}
"""Why a stop is latched; ``{joint}`` is the joint that is meant, ``{pair}`` the two bodies."""

REPEATS: Final = (
    "the encoder of {joint} repeats its number: it is frozen, or the joint stands; call reset() once it is "
    "mended, or report what befell the joint and call resume()"
)
"""Why a stop is latched for the sensor of a joint that may as well stand behind a brake."""


def with_reason(said: str, reason: str | None) -> str:
    """What is said of an arm that was stopped, with why."""
    return said if reason is None else f"{said}: {reason}"
