"""A motion of all joints at once that distinguishes rotors, friction, load, gains and offsets."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np

from ftqp.core.checks import FloatArray, positive, read_only
from ftqp.core.errors import InputError
from ftqp.model.fitting.fitted_arm import KINDS, sizes_of, torques
from ftqp.model.fitting.torque_log import Pieces
from ftqp.model.robot import Robot

PERIOD = 10.0
"""Of the motion [s]. A convention: two of them are in the usual 20 s."""
WAVES = 8
"""Sines a joint, from one a period on; 0.8 Hz is the fastest."""
V_SHARE, A_SHARE, TAU_SHARE = 0.6, 0.6, 0.7
"""Of the limits of speed, acceleration and torque, because loads and rotors are not known yet."""
MARGIN = 0.1
"""Room to the ends of the range [rad or m]."""
FREE_RANGE = 1.5
"""How far a joint without a range goes to either side [rad or m]."""
RISE = 2.0
"""The motion comes up from rest and goes back to it within such a time [s]."""
CANDIDATES, SHRINKINGS, SHRINK = 40, 12, 0.85
"""So many motions are drawn, and each is made smaller so often, by this factor, until it is within limits
and clear of what is around; the one that tells most is taken. ``python studies/identify.py`` shows what it
tells."""
LOOK, EVERY = 0.05, 4
"""Torques and surroundings are looked at in such steps [s], and what each of so many of them shows."""
PRECISION = 0.01
"""A torque that is known to this share of its limit: what the motions are compared by."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExcitingMotion:
    """A motion from rest to rest at the same posture.

    Attributes:
        t: Times, (K,) [s].
        q: Positions, (K, nv) [rad or m].
        v: Velocities, (K, nv) [rad/s or m/s].
        a: Accelerations, (K, nv) [rad/s2 or m/s2].
    """

    t: FloatArray
    q: FloatArray
    v: FloatArray
    a: FloatArray

    def __post_init__(self) -> None:
        read_only(self)

    def __repr__(self) -> str:
        return f"ExcitingMotion({len(self.t)} samples of {self.q.shape[1]} joints, {self.t[-1]:g} s)"


def exciting_motion(
    robot: Robot,
    q: FloatArray | None = None,
    *,
    duration: float = 20.0,
    dt: float = 0.001,
    clear: Callable[[FloatArray], bool] | None = None,
    seed: int = 0,
) -> ExcitingMotion:
    """A sum of sines in every joint, the best of some random ones, within limits.

    q(t) = q_0 + s(t) (c + sum_l (a_l sin(l w t) + b_l cos(l w t))), s from 0 to 1 and back within 2 s

    The one with the largest log det(1 + A'A) is taken, A the columns of all unknowns at their usual sizes.

    Args:
        robot: The arm; its model's masses make the torques that are kept in their limits.
        q: Where it begins and ends, (nv,) or (nq,) [rad or m]; None is the robot's neutral posture.
        duration: How long it takes, at least 6 s [s].
        dt: The time between samples, > 0 [s].
        clear: Whether the arm is clear of itself and of all else at postures (S, nv); None does not look.
        seed: Of the random motions.

    Raises:
        InputError: The arm has no masses, a value is out of its range, or no motion of any size is clear.

    Source: Swevers et al. 1997, the sums of sines; the determinant in place of their condition number.
    """
    robot.refuse_floating("a motion to identify needs")
    if not robot.has_inertia:
        raise InputError(f"{robot.name} has no masses, so no torques; give the model its masses first")
    if positive("duration", duration, "s") < 3.0 * RISE:
        raise InputError(f"duration is {duration:g} s, expected {3.0 * RISE:g} s or more")
    start = robot.neutral if q is None else robot.angles(q)
    low, high = _range(robot, start)
    rng = np.random.default_rng(seed)
    t: FloatArray = np.arange(round(duration / positive("dt", dt, "s")) + 1, dtype=np.float64) * dt
    seen = np.arange(0.0, duration, LOOK)
    best, most = None, -np.inf
    for _ in range(CANDIDATES):
        shape = _Shape(rng, start, low, high, duration)
        size = shape.fitting(robot, seen)
        for _ in range(SHRINKINGS):
            motion = shape.motion(size, seen)
            information = _information(robot, motion)
            if information is not None and (clear is None or clear(motion[0])):
                if information > most:
                    best, most = (shape, size), information
                break
            size = SHRINK * size
    if best is None:
        raise InputError(
            f"no motion of {robot.name} from this posture is clear of itself and of what is around it, nor "
            "within its torques; begin at a posture with more room"
        )
    q_all, v, a = best[0].motion(best[1], t)
    return ExcitingMotion(t=t, q=q_all, v=v, a=a)


class _Shape:
    """Sines and centres of one candidate, before they are scaled to the limits."""

    def __init__(
        self, rng: np.random.Generator, start: FloatArray, low: FloatArray, high: FloatArray, duration: float
    ) -> None:
        self._start, self._duration, n = start, duration, len(start)
        waves = np.arange(1, WAVES + 1)
        self._w = 2.0 * np.pi * waves / PERIOD
        self._c = rng.standard_normal((2, WAVES, n)) / waves[:, None]
        self._c /= np.abs(self._c).sum(axis=(0, 1))
        half = 0.5 * (high - low)
        self._centre, self._reach = 0.5 * (high + low) + rng.uniform(-0.5, 0.5, n) * half - start, 0.5 * half

    def fitting(self, robot: Robot, t: FloatArray) -> FloatArray:
        """The largest size of each joint's motion that keeps speeds and accelerations, (nv,)."""
        size = np.ones(robot.nv)
        _, v, a = self.motion(size, t)
        for values, limit, share in ((v, robot.limits.v_max, V_SHARE), (a, robot.limits.a_max, A_SHARE)):
            size = np.minimum(size, share * limit / np.maximum(np.abs(values).max(axis=0), 1e-12))
        return size

    def motion(self, size: FloatArray, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """q, v and a at times t, each (K, nv)."""
        centre, reach = self._centre, self._reach
        phase = np.outer(t, self._w)
        sines, cosines = np.sin(phase), np.cos(phase)
        x = centre + reach * (sines @ self._c[0] + cosines @ self._c[1])
        v = reach * ((cosines * self._w) @ self._c[0] - (sines * self._w) @ self._c[1])
        a = -reach * ((sines * self._w**2) @ self._c[0] + (cosines * self._w**2) @ self._c[1])
        s, ds, dds = (part[:, None] for part in _rise(t, self._duration))
        return self._start + size * s * x, size * (s * v + ds * x), size * (s * a + 2.0 * ds * v + dds * x)


def _rise(t: FloatArray, duration: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """From 0 to 1 within RISE, and back, by polynomials of degree 5; with two derivatives."""
    up = np.clip(np.minimum(t, duration - t) / RISE, 0.0, 1.0)
    sign = np.where(t < 0.5 * duration, 1.0, -1.0)
    s = up**3 * (10.0 - 15.0 * up + 6.0 * up**2)
    ds = 30.0 * up**2 * (1.0 - up) ** 2 / RISE
    dds = 60.0 * up * (1.0 - up) * (1.0 - 2.0 * up) / RISE**2
    return s, sign * ds, dds


def _range(robot: Robot, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where each joint may go, (nv,) each."""
    low = np.maximum(robot.limits.q_min + MARGIN, start - 2.0 * FREE_RANGE)
    high = np.minimum(robot.limits.q_max - MARGIN, start + 2.0 * FREE_RANGE)
    free = ~(np.isfinite(robot.limits.q_min) & np.isfinite(robot.limits.q_max))
    low, high = np.where(free, start - FREE_RANGE, low), np.where(free, start + FREE_RANGE, high)
    return np.minimum(low, start), np.maximum(high, start)


def _information(robot: Robot, motion: tuple[FloatArray, FloatArray, FloatArray]) -> float | None:
    """How much the motion shows; None where its torques are too large."""
    q, v, a = motion
    zero = np.zeros_like(q)
    at = Pieces(np.arange(len(q), dtype=float), q, v, a, zero, LOOK, 0.0)
    tau = torques(robot, at)
    if (np.abs(tau) > TAU_SHARE * robot.limits.tau_max).any():
        return None
    at = at._replace(t=at.t[::EVERY], q=q[::EVERY], v=v[::EVERY], a=a[::EVERY], tau=tau[::EVERY])
    sizes = sizes_of(robot, at)
    columns = np.concatenate(
        [kind.columns(robot, at, at.tau) * np.atleast_1d(kind.usual(sizes)) for kind in KINDS.values()],
        axis=2,
    )
    rows = (columns / (PRECISION * sizes.tau)[:, None]).reshape(-1, columns.shape[2])
    return float(np.linalg.slogdet(np.eye(rows.shape[1]) + rows.T @ rows)[1])
