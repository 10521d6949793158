"""Which locked joints a task can survive: the rank of what is left of the Jacobian, over sampled postures."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.model.chain import frame_id
from ftqp.model.followers import coupled_columns, coupled_places
from ftqp.model.posture import NEAR_SINGULAR, scaled_jacobian
from ftqp.model.robot import Robot
from ftqp.model.shape import random_postures

SAMPLES = 400
"""Postures that are looked at: enough that one in a hundred is met with a probability of 0.98."""

NO_RANK = 1e-7
"""Where sigma_min over the characteristic length stays below this, a direction is lost by structure."""

SEED = 20170511


@dataclass(frozen=True, slots=True, kw_only=True)
class Locks:
    """What a lock of each joint leaves of a task.

    Attributes:
        possible: Whether the healthy arm has the rank that the task needs anywhere.
        left: Share of the sampled postures at which the other joints still have it, by joint, 0 to 1.
        fatal: The joints whose lock no sampled posture survives, by structure.
    """

    possible: bool
    left: dict[str, float]
    fatal: tuple[str, ...]


def locks(robot: Robot, rows: Sequence[str]) -> Locks:
    """What a lock of each joint leaves of the rows of a task, over postures inside the limits.

    A posture survives the lock of joint i where the Jacobian without column i has sigma_min >=
    ``NEAR_SINGULAR`` times the characteristic length. A lock is fatal by structure where sigma_min is zero to
    rounding at every posture: then the joint's angle alone decides what the task gets, as the elbow of an arm
    with spherical shoulder and wrist decides the distance of the hand. The samples are the same every time.
    """
    model, data, tip, m = robot.model, robot.model.createData(), frame_id(robot.model, robot.tip), len(rows)
    J = np.array(
        [
            coupled_columns(
                robot.chain,
                scaled_jacobian(model, data, tip, robot.configuration(q), rows, robot.length),
            )
            for q in coupled_places(
                robot.chain,
                random_postures(robot.limits, robot.chain.prismatic, SAMPLES, np.random.default_rng(SEED)),
            )
        ]
    )
    healthy = _sigma(J, m) / robot.length
    left, fatal = {}, []
    for i, joint in enumerate(robot.joints):
        rest = _sigma(np.delete(J, i, axis=2), m) / robot.length
        left[joint] = float(np.mean(rest >= NEAR_SINGULAR))
        if rest.max() < NO_RANK:
            fatal.append(joint)
    return Locks(possible=bool(healthy.max() >= NO_RANK), left=left, fatal=tuple(fatal))


def _sigma(J: FloatArray, m: int) -> FloatArray:
    """The m-th singular value of each, (S,); zeros where there are fewer columns."""
    if J.shape[2] < m:
        return np.zeros(len(J))
    return np.asarray(np.linalg.svd(J, compute_uv=False)[:, m - 1], dtype=np.float64)
