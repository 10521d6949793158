"""How far a tip is turned away from where it should be."""

from typing import Any

import numpy as np

import ftqp
from ftqp.model.chain import Skeleton


def turned(robot: ftqp.Robot, q: Any, poses: Any) -> Any:
    """How far the tip of an arm was turned away from where it should have been, (K,) [rad]."""
    tips = Skeleton.of(robot.chain).frames(q)[:, -1, :3, :3]
    cosine = 0.5 * (np.einsum("kij,kij->k", tips, poses[:, :3, :3]) - 1.0)
    return np.arccos(np.clip(cosine, -1.0, 1.0))
