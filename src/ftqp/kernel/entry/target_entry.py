"""A target written from the caller's arrays in one call."""

from collections.abc import Callable
from typing import Any

from ftqp.kernel.compiled.taking import take
from ftqp.kernel.layout.enums import NOT_READ, TARGET_ACCELERATION, TARGET_POSE, TARGET_TWIST


def write_target(capacity: int) -> Callable[..., int]:
    """Pose, twist and acceleration into a packed target: 0, or a mistake, and then nothing is written."""

    def write_target(target_at: int, pose: Any, twist: Any, acceleration: Any) -> int:
        pose_at, twist_at = target_at + 8 * TARGET_POSE, target_at + 8 * TARGET_TWIST
        acceleration_at = target_at + 8 * TARGET_ACCELERATION
        # how many there are, before any is copied
        if (
            take(pose, 0, pose_at, 0, 2) != 16
            or take(twist, 0, twist_at, 0, 1) != 6
            or take(acceleration, 0, acceleration_at, 0, 1) != 6
        ):
            return NOT_READ
        take(pose, 0, pose_at, 16, 2)
        take(twist, 0, twist_at, 6, 1)
        take(acceleration, 0, acceleration_at, 6, 1)
        return 0

    return write_target
