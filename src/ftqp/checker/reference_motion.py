"""A motion that follows a target with room to spare: whoever asks for it knows that it can be followed."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import pinocchio as pin

from ftqp.checker.model_file import ModelFile
from ftqp.core.checks import FloatArray

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
ROWS: Final = ("x", "y", "z", "rx", "ry", "rz")


def followable(arm: ModelFile, q: FloatArray, target: FloatArray, rows: Sequence[str], dt: float) -> float:
    """How long a target is certain to be within reach, speed and strength of an arm that starts at rest [s].

    The joints are led along the target by the least change that keeps to it, J+ e, again and again. While
    that motion keeps to a half of the limits of speed and acceleration, to 70 % of the torques and away from
    the ends of the joints' ranges, it is a witness: the target can be followed. Where it does not, nothing is
    said.

    Args:
        arm: The arm.
        q: Where it starts, (nv,) [rad or m].
        target: What is asked at each tick, (K, 4, 4) [m].
        rows: The rows of the task, of x, y, z, rx, ry, rz.
        dt: Between ticks [s].
    """
    every = max(1, round(PERIOD / dt))
    h = every * dt
    wanted = np.array([row in rows for row in ROWS])
    data = arm.model.createData()
    low, high = _inner(arm)
    at, v = np.array(q, dtype=np.float64), np.zeros(len(q))
    for k in range(0, len(target), every):
        after = _solved(arm, data, at, target[k], wanted)
        if after is None or (after < low).any() or (after > high).any():
            return max(0, k - every) * dt
        now = (after - at) / h
        a = (now - v) / h
        if k and not (
            (np.abs(now) <= SPEED * arm.v_max).all()
            and (np.abs(a) <= ACCELERATION * arm.a_max).all()
            and _strong(arm, at, v, a)
        ):
            return max(0, k - every) * dt
        at, v = after, now if k else v
    return len(target) * dt


def _inner(arm: ModelFile) -> tuple[FloatArray, FloatArray]:
    """The ranges of the joints without their ends."""
    with np.errstate(invalid="ignore"):
        width = np.where(np.isfinite(arm.q_max - arm.q_min), ROOM * (arm.q_max - arm.q_min), 0.0)
    return arm.q_min + width, arm.q_max - width


def _strong(arm: ModelFile, q: FloatArray, v: FloatArray, a: FloatArray) -> bool:
    """Whether the joints carry a motion with a part of their torques."""
    if not arm.has_masses:
        return True
    tau = arm.torques(q[None], v[None], a[None])[0]
    return bool((np.abs(tau) <= TORQUE * arm.tau_max).all())


def _solved(arm: ModelFile, data: Any, q: FloatArray, target: FloatArray, wanted: Any) -> FloatArray | None:
    """The posture near q with its tip on a target; None where there is none, or the task is singular."""
    at = q.copy()
    for _ in range(STEPS):
        tip, J = arm.tip_and_jacobian(data, at)
        error = np.concatenate([target[:3, 3] - tip[:3, 3], pin.log3(target[:3, :3] @ tip[:3, :3].T)])
        error = error[wanted]
        if np.abs(error).max() < NEAR:
            return at
        J = J[wanted]
        U, sigma, V = np.linalg.svd(J, full_matrices=False)
        if len(sigma) < len(error) or sigma[-1] < LEAST * max(sigma[0], 1.0):
            return None
        at = at + V.T @ ((U.T @ error) / sigma)
    return None
