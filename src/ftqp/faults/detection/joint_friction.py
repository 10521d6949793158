"""Coulomb and viscous friction of every joint, from a log of healthy motion with torques."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.faults.detection.motion_log import MotionLog
from ftqp.model.payload import Payload
from ftqp.model.robot import Robot

BLOCK = 0.025
"""Time over which samples are averaged [s]. A guess that `python studies/detection.py` has not
contradicted."""
SLOWEST = 0.03
"""Joints slower than this [rad/s or m/s] do not tell the sign of their friction. A guess that
`python studies/detection.py` has not contradicted."""
MOST_BLOCKS = 3000
"""More averaged samples tell no more."""
SIGNIFICANT = 6.0
"""Friction below so many standard deviations is none: averaged samples are not independent. Three would be
enough for independent ones. A guess that `python studies/detection.py` has not contradicted."""
FEWEST = 30
"""A joint with fewer is left without friction."""


class Friction(NamedTuple):
    """Friction of the joints beside that of the model.

    Attributes:
        coulomb: (nv,) [N m or N].
        viscous: (nv,) [N m s/rad or N s/m].
    """

    coulomb: FloatArray
    viscous: FloatArray


def friction_of(robot: Robot, logs: Sequence[MotionLog], dt: float, delay: int) -> Friction:
    """Friction by least squares, together with an unknown load at the tip.

    tau - (M a + h) = f_c sign(v) + f_v v + G(q) (m, m c), all averaged over 25 ms; G is what a load of mass m
    with its centre c weighs at the joints.

    Source: docs/theory/detection.md, "Friction".
    """
    n, width = robot.nv, max(round(BLOCK / dt), 2)
    parts = [_averages(log, dt, delay, width) for log in logs if len(log) > 3 * width + delay]
    if not parts or not robot.has_inertia:
        return Friction(np.zeros(n), np.zeros(n))
    q, v, a, tau = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    every = max(1, len(q) // MOST_BLOCKS)
    q, v, a, tau = q[::every], v[::every], a[::every], tau[::every]
    rest = np.array(
        [t - robot.mass_matrix(x) @ y - robot.bias(x, w) for x, w, y, t in zip(q, v, a, tau, strict=True)]
    )
    loads = _loads(robot, q)
    moving = np.abs(v) > SLOWEST
    row, joint = np.nonzero(moving)
    enough = moving.sum(axis=0) >= FEWEST
    A = np.zeros((len(row), 2 * n + loads.shape[2]))
    A[np.arange(len(row)), joint] = np.sign(v[moving])
    A[np.arange(len(row)), n + joint] = v[moving]
    A[:, 2 * n :] = loads[row, joint]
    weight = 1.0 / np.maximum(robot.limits.tau_max, 1e-9)
    weight = np.where(np.isfinite(weight) & (weight > 0.0), weight, 1.0)[joint]
    A, y = A * weight[:, None], rest[moving] * weight
    found = np.linalg.lstsq(A, y, rcond=1e-8)[0]
    left = y - A @ found
    spread = np.array([np.std(left[joint == i]) if (joint == i).any() else 0.0 for i in range(n)])
    deviation = np.sqrt(np.diag(np.linalg.pinv(A.T @ A))[: 2 * n]) * np.tile(spread, 2)
    sure = np.abs(found[: 2 * n]) > SIGNIFICANT * deviation
    coulomb = np.where(enough & sure[:n], np.maximum(found[:n], 0.0), 0.0)
    return Friction(coulomb, np.where(enough & (sure[:n] | sure[n:]), found[n : 2 * n], 0.0))


def _averages(
    log: MotionLog, dt: float, delay: int, width: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """q, v, a and the torque of the motors of blocks of so many samples."""
    tau = log.tau
    if tau is None:
        assert log.effort is not None
        tau, late = log.effort, 1 + delay
    else:
        late = 0
    rows = len(log) - late
    count = rows // width
    q = log.q[late : late + count * width].reshape(count, width, -1)
    torque = tau[: count * width].reshape(count, width, -1).mean(axis=1)
    middle = np.arange(width) - 0.5 * (width - 1)
    v = np.tensordot(q, middle, axes=([1], [0])) / (middle @ middle * dt)
    place = q.mean(axis=1)
    a = np.gradient(v, width * dt, axis=0)
    keep = slice(1, count - 1)
    return place[keep], v[keep], a[keep], torque[keep]


def _loads(robot: Robot, q: FloatArray) -> FloatArray:
    """What a mass at the tip, and its first moments, weigh at the joints, (K, nv, 4)."""
    rest = np.zeros(robot.nv)
    here = robot.with_payload(Payload(1.0, (0.0, 0.0, 0.0)))
    sides = [robot.with_payload(Payload(1.0, tuple(0.1 * np.eye(3)[k]))) for k in range(3)]
    result = np.zeros((len(q), robot.nv, 4))
    for row, x in enumerate(q):
        bare, mass = robot.bias(x, rest), here.bias(x, rest)
        result[row, :, 0] = mass - bare
        for k, side in enumerate(sides):
            result[row, :, 1 + k] = (side.bias(x, rest) - mass) / 0.1
    return result
