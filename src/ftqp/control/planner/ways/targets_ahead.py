"""Where the tip is to be over a horizon, worked out beside the ticks without holding them up."""

from typing import Final

import numpy as np

from ftqp.control.paths.path import Path
from ftqp.control.planner.target import Targets
from ftqp.core.checks import FloatArray
from ftqp.core.clock import give_way
from ftqp.core.pose import rotation_exp, transform
from ftqp.kernel.layout.enums import TARGET_POSE, TARGET_TWIST

AT_ONCE: Final = 200
"""So many ticks are worked out at once: 0.2 ms in which the thread holds Python's lock."""


def targets_ahead(
    path: tuple[Path, float] | None, packed: FloatArray, tip: FloatArray, t: FloatArray
) -> FloatArray:
    """Targets along a path, or along the twist of the last target, packed, (T, 29).

    Args:
        path: What is followed, and the time of it now [s]; None goes on with the target's twist.
        packed: The target now, (29,).
        tip: Where the tip is, which stays there if the target is none, (4, 4) [m].
        t: The times, (T,) [s].
    """
    if path is None:
        return _along_twist(packed, tip, t)
    way, at = path
    parts = []
    for part in np.split(t, range(AT_ONCE, len(t), AT_ONCE)):
        sample = way.sample(np.minimum(at + part, way.duration))
        ends = (at + part > way.duration)[:, None]
        twist, acceleration = np.where(ends, 0.0, sample.twist), np.where(ends, 0.0, sample.acceleration)
        parts.append(Targets(sample.pose, twist, acceleration).packed)
        give_way()
    return np.concatenate(parts)


def _along_twist(packed: FloatArray, tip: FloatArray, t: FloatArray) -> FloatArray:
    pose = packed[TARGET_POSE : TARGET_POSE + 16].reshape(4, 4)
    twist = packed[TARGET_TWIST : TARGET_TWIST + 6]
    if not np.isfinite(pose).all() or np.linalg.det(pose[:3, :3]) < 0.5:
        pose, twist = tip, np.zeros(6)
    if not twist.any():
        return Targets(np.repeat(pose[None], len(t), axis=0)).packed
    poses = []
    for k, s in enumerate(t):
        poses.append(transform(rotation_exp(twist[3:] * s) @ pose[:3, :3], pose[:3, 3] + twist[:3] * s))
        if k % AT_ONCE == 0:
            give_way()
    return Targets(np.array(poses), np.repeat(twist[None], len(t), axis=0)).packed
