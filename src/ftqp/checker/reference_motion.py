"""A motion that follows a target with room to spare: whoever asks for it knows that it can be followed."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import pinocchio as pin

from ftqp.checker.model_file import ModelFile
from ftqp.checker.trace import ROWS
from ftqp.core.checks import BoolArray, FloatArray

PERIOD: Final = 0.01
"""The motion is looked for every so many seconds, or every tick where ticks are longer [s]."""
STEPS: Final = 8
"""Newton steps at most from sample to sample."""
NEAR: Final = 1e-7
"""The motion is on its target to this [m and rad]."""
SPEED, ACCELERATION, TORQUE = 0.5, 0.5, 0.7
"""Shares of the limits that the motion keeps to."""
ROOM: Final = 0.02
"""Distance that it keeps from the ends of a range, as a share of it."""
LEAST: Final = 1e-3
"""A task is singular where a unit of motion along it takes more than 1/LEAST of the joints."""
KEPT: Final = 0.9
"""Share of its velocity that an arm keeps from sample to sample in what the task leaves free, ..."""
PULLED: Final = 0.3
"""... where a posture draws it, with up to this share of its speed limits."""


def followable(arm: ModelFile, q: FloatArray, target: FloatArray, rows: Sequence[str], dt: float) -> float:
    """How long a target is certain to be within reach, speed and strength of an arm that starts at rest [s].

    The joints are led along the target by the least change that keeps to it, J+ e, again and again. While
    that motion keeps to a half of the limits of speed and acceleration, to 70 % of the torques and away from
    the ends of the joints' ranges, it is a witness: the target can be followed. Where it does not, nothing is
    said.
    """
    every = max(1, round(PERIOD / dt))
    reached = followed(arm, q, np.zeros(len(q)), target[::every], rows, every * dt)
    return len(target) * dt if reached == len(target[::every]) else max(0, reached - 1) * every * dt


def followed(
    arm: ModelFile,
    q: FloatArray,
    v: FloatArray,
    target: FloatArray,
    rows: Sequence[str],
    h: float,
    *,
    moves: BoolArray | None = None,
    drawn_to: FloatArray | None = None,
    shares: tuple[float, float, float] = (SPEED, ACCELERATION, TORQUE),
) -> int:
    """How many samples of a target the joints follow by the least change, within shares of their limits."""
    wanted = np.array([row in rows for row in ROWS])
    data = arm.model.createData()
    low, high = _inner(arm)
    free = np.ones(len(q), dtype=np.bool_) if moves is None else moves
    low, high = np.where(free, low, -np.inf), np.where(free, high, np.inf)
    at, before = np.array(q, dtype=np.float64), np.where(free, v, 0.0)
    for k, pose in enumerate(target):
        guess = at
        if drawn_to is not None and k:
            pull = np.where(free, np.clip(drawn_to - at, -PULLED * arm.v_max, PULLED * arm.v_max), 0.0)
            guess = at + h * (KEPT * before + (1.0 - KEPT) * pull)
        after = _solved(arm, data, guess, pose, wanted, free)
        if after is None or (after < low).any() or (after > high).any():
            return k
        now = (after - at) / h
        if k and not (
            (np.abs(now) <= shares[0] * arm.v_max)[free].all()
            and (np.abs(now - before) <= h * shares[1] * arm.a_max)[free].all()
            and _strong(arm, at, before, (now - before) / h, shares[2])
        ):
            return k
        at, before = after, now if k else before
    return len(target)


def _inner(arm: ModelFile) -> tuple[FloatArray, FloatArray]:
    """The ranges of the joints without their ends."""
    with np.errstate(invalid="ignore"):
        width = np.where(np.isfinite(arm.q_max - arm.q_min), ROOM * (arm.q_max - arm.q_min), 0.0)
    return arm.q_min + width, arm.q_max - width


def _strong(arm: ModelFile, q: FloatArray, v: FloatArray, a: FloatArray, share: float) -> bool:
    """Whether the joints carry a motion with a part of their torques."""
    if not arm.has_masses:
        return True
    tau = arm.torques(q[None], v[None], a[None])[0]
    return bool((np.abs(tau) <= share * arm.tau_max).all())


def _solved(
    arm: ModelFile, data: Any, q: FloatArray, target: FloatArray, wanted: Any, free: Any
) -> FloatArray | None:
    """The posture near q with its tip on a target; None where there is none, or the task is singular."""
    at = q.copy()
    for _ in range(STEPS):
        tip, J = arm.tip_and_jacobian(data, at)
        error = np.concatenate([target[:3, 3] - tip[:3, 3], pin.log3(target[:3, :3] @ tip[:3, :3].T)])
        error = error[wanted]
        if np.abs(error).max() < NEAR:
            return at
        J = J[wanted][:, free]
        U, sigma, V = np.linalg.svd(J, full_matrices=False)
        if len(sigma) < len(error) or sigma[-1] < LEAST * max(sigma[0], 1.0):
            return None
        at = at.copy()
        at[free] += V.T @ ((U.T @ error) / sigma)
    return None
