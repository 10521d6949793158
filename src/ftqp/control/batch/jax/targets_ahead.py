"""What the targets of a batch say to every arm alike: whether they are usable, and whether they stand."""

from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from ftqp.core.checks import FloatArray
from ftqp.kernel.layout.enums import TARGET_HAS_ROTATION, TARGET_TWIST
from ftqp.kernel.layout.thresholds import ORTHONORMAL_TOLERANCE

STANDS_WITHIN = 5e-4
"""A target that stays within this of where it came to stand, does stand [m; rotations times the length]."""
STANDS_BELOW = 2e-3
"""... if it is not said to move faster than this [m/s; rotations times the length]."""


class TargetsAhead(NamedTuple):
    """All ticks of a batch.

    Attributes:
        packed: Targets, (T, 29).
        usable: Whether each is finite and its rotation, if it has one, is one, (T,).
        stands: Whether it is where it was, (T,).
        anchors: Where it stands before each tick, (T, 12).
    """

    packed: FloatArray
    usable: NDArray[np.bool_]
    stands: NDArray[np.bool_]
    anchors: FloatArray

    @classmethod
    def of(cls, K: Any, packed: FloatArray) -> Self:
        """Look at packed targets as ``ftqp.kernel.calm.rest`` and ``ticks.accepted_inputs`` do.

        Args:
            K: A planner's record as after a reset.
            packed: (T, 29).
        """
        with np.errstate(invalid="ignore", over="ignore"):  # of targets that are no numbers
            return cls(packed, _usable(packed), *_stands(K, packed))


def _stands(K: Any, packed: FloatArray) -> tuple[NDArray[np.bool_], FloatArray]:
    """Whether each target is slow and near its anchor, else it is the next one; the anchors."""
    length = float(K.task.length) if K.task.uses_rotation else 0.0
    weight = np.repeat([[np.sqrt(0.5) * length] * 3 + [1.0]], 3, axis=0).ravel()
    twists = packed[:, TARGET_TWIST : TARGET_TWIST + 6] * np.repeat([1.0, length], 3)
    slow = (twists * twists).sum(axis=1) <= STANDS_BELOW**2
    anchor = K.calm.anchor.copy()
    stands, anchors = np.zeros(len(packed), dtype=bool), np.empty((len(packed), 12))
    for k, pose in enumerate(packed[:, :12]):
        anchors[k] = anchor
        way = weight * (pose - anchor)
        stands[k] = slow[k] and way @ way <= STANDS_WITHIN**2
        if not stands[k]:
            anchor = pose
    return stands, anchors


def _usable(packed: FloatArray) -> NDArray[np.bool_]:
    """Finite numbers, and |R'R - I| small with det R > 0 where there is a rotation, (T,)."""
    finite = np.all(np.isfinite(packed[:, :TARGET_HAS_ROTATION]), axis=1)
    R = np.where(finite[:, None, None], packed[:, :12].reshape(-1, 3, 4)[:, :, :3], 0.0)
    off = np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max(axis=(1, 2), initial=0.0)
    turns = (off <= ORTHONORMAL_TOLERANCE) & (np.linalg.det(R) > 0.0)
    good: NDArray[np.bool_] = finite & (turns | (packed[:, TARGET_HAS_ROTATION] <= 0.0))
    return good
