"""A point-to-point law that learns, from how the tip moves, which joints do not carry out their commands."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, final
from warnings import warn

import numpy as np

from ftqp.analysis.goals import GoalStudy, goal_study
from ftqp.analysis.outcomes.unaware_law import weights_inverse
from ftqp.core.checks import FloatArray, array, non_negative, positive, whole_number
from ftqp.core.errors import InputError
from ftqp.model.robot import Robot

INITIAL_DEVIATION = 0.5
"""Standard deviation of an effectiveness before anything was seen; a failed joint has 0, a healthy one 1."""
LARGEST_DEVIATION = 1.0
"""Standard deviation of an effectiveness of which nothing was seen for long."""
DRIFT = 0.03
"""How far an effectiveness may have moved after a second, as a standard deviation [1/sqrt(s)]."""
ACCURACY = 1e-3
"""Share of a motion of the tip by which J dq may be wrong, since a sample is no infinitesimal time."""
LEAST = 1e-9
"""Motions of the tip below this are rounding [m]."""


@final
class Effectiveness:
    """The share of its commanded motion that each joint carries out: 1 healthy, 0 locked.

    The end effector moves by dx = J diag(theta) dq while dq is commanded, so a motion tells of those joints
    that were commanded to move the end effector. theta is estimated by a Kalman filter with a random walk; it
    is not bounded within the filter, and ``theta`` bounds what it returns.
    Source: docs/theory/learned-jacobian.md.

    Args:
        joints: The number of joints.
        dt: The sampling period [s].
        noise: Standard deviation of a measured tip position [m]. A larger one learns more slowly.
        drift: How far an effectiveness may move after a second, as a standard deviation. A larger one forgets
            sooner, and a fault is seen sooner after a long healthy motion.

    Raises:
        InputError: A parameter is out of its range.
    """

    def __init__(self, joints: int, dt: float, *, noise: float = 0.0, drift: float = DRIFT) -> None:
        whole_number("joints", joints, 1)
        self._dt = positive("dt", dt, "s")
        self._step = positive("drift", drift, "1/sqrt(s)") ** 2 * self._dt
        self._noise = 2.0 * non_negative("noise", noise, "m") ** 2 + LEAST**2
        self._theta = np.ones(joints)
        self._P = INITIAL_DEVIATION**2 * np.eye(joints)

    @property
    def theta(self) -> FloatArray:
        """The share of its command that each joint carries out, (nv,), each in [0, 1]; a copy."""
        return np.clip(self._theta, 0.0, 1.0)

    @property
    def deviation(self) -> FloatArray:
        """How uncertain each of them is, as a standard deviation, (nv,)."""
        return np.sqrt(np.diag(self._P))

    def learn(self, J: Any, dq: Any, dx: Any) -> None:
        """Take a motion into account.

        Args:
            J: The Jacobian on the way, (m, nv) [m/rad].
            dq: What the joints were commanded to move by, (nv,) [rad].
            dx: What the end effector was seen to move by, (m,) [m].

        Raises:
            InputError: A shape is another one, or a number is NaN or infinite.
        """
        n = len(self._theta)
        moved = array("dq", dq, (n,), "(nv,)")
        seen = np.asarray(dx, dtype=np.float64)
        column = array("J", J, (seen.size, n), "(m, nv)") * moved
        seen = array("dx", dx, (len(column),), "(m,)")
        size = float(np.abs(column).sum())
        R = (self._noise + (ACCURACY * size) ** 2) * np.eye(len(column))
        PC = self._P @ column.T
        gain = np.linalg.solve(column @ PC + R, PC.T).T
        self._theta = self._theta + gain @ (seen - column @ self._theta)
        kept = np.eye(n) - gain @ column
        self._P = kept @ self._P @ kept.T + gain @ R @ gain.T + self._step * np.eye(n)
        least = np.minimum(1.0, LARGEST_DEVIATION / self.deviation)
        self._P *= np.outer(least, least)


NEAR_SINGULAR = 0.2
"""Singular values below this share of the characteristic length are damped."""


@final
class LearnedLaw:
    """v = W^-1 J_e' (J_e W^-1 J_e')^-1 x' with J_e = J diag(theta), theta learned from measured motion.

    A joint that is seen not to move the end effector loses its share of the work, so the remaining joints
    take it over, although nobody said which joint has failed. Singular values below a fifth of the
    characteristic length are damped, and the joints keep their limits of speed together. With
    ``learns=False`` it is the law of Goel et al. 2005 as it stands: theta stays 1, nothing is damped, speeds
    are not limited.
    Source: docs/theory/learned-jacobian.md.

    Args:
        robot: The arm.
        goal: Where the end effector is to go: a point, (2,) or (3,) [m], or a pose, (4, 4).
        rows: The task rows, ``"position"``, ``"pose"`` or names of rows.
        W: Weights of the joint rates, (nv, nv) or their diagonal, (nv,); None is the identity.
        gain: K_e > 0 [1/s]. A larger one goes faster, up to the limits of speed.
        v_max: The largest speed of the end effector, > 0 [m/s]; None is none.
        dt: The sampling period, > 0 [s].
        noise: Standard deviation of the measured tip, >= 0 [m]. A larger one learns more slowly.
        learns: Whether theta is learned.

    Raises:
        InputError: A parameter is out of its range, or the goal does not fit the rows.
    """

    def __init__(
        self,
        robot: Robot,
        goal: Any,
        *,
        rows: Any = "position",
        W: Any = None,
        gain: float = 1.0,
        v_max: float | None = None,
        dt: float = 0.01,
        noise: float = 0.0,
        learns: bool = True,
    ) -> None:
        self._study: GoalStudy = goal_study(robot, goal, rows)
        self._M = weights_inverse(W, robot.nv)
        self._gain = positive("gain", gain, "1/s")
        self._most = np.inf if v_max is None else positive("v_max", v_max, "m/s")
        self._dt = positive("dt", dt, "s")
        self._least = NEAR_SINGULAR * robot.length if learns else 0.0
        self._v_max = robot.limits.v_max
        self._learns = bool(learns)
        self._learned = Effectiveness(robot.nv, dt, noise=non_negative("noise", noise, "m"))
        self._last: tuple[FloatArray, FloatArray, FloatArray] | None = None

    @property
    def theta(self) -> FloatArray:
        """The share of its command that each joint is believed to carry out, (nv,), in [0, 1]; a copy."""
        return self._learned.theta

    def error(self, q: Any) -> FloatArray:
        """e, what the rows lack to the goal, (m,) [m]; angular rows are multiplied by the length.

        Args:
            q: The configuration, (nv,) [rad or m].
        """
        return self._values(q)[0]

    def _values(self, q: Any) -> tuple[FloatArray, FloatArray]:
        """e and J of the rows."""
        e, A, _, _ = self._study.free.values(np.atleast_2d(q))
        return e[0], A[0]

    def command(self, q: Any, error: Any = None) -> FloatArray:
        """The joint rates for the next dt, (nv,) [rad/s or m/s].

        Args:
            q: Measured configuration, (nv,) [rad or m].
            error: Measured e, (m,), for example of a camera; None takes that of the configuration.

        Raises:
            InputError: A shape is another one, or a number is NaN or infinite.
        """
        at = array("q", q, (len(self._v_max),), "(nv,)")
        e, J = self._values(at)
        if error is not None:
            e = array("error", error, e.shape, "(m,)")
        if self._learns and self._last is not None:
            J_before, e_before, moved = self._last
            self._learned.learn(0.5 * (J_before + J), moved, e_before - e)
        v = self._rates(J * self.theta, e)
        self._last = J, e, self._dt * v
        return v

    def _rates(self, J: FloatArray, e: FloatArray) -> FloatArray:
        """The weighted pseudoinverse, damped near singularities, within the limits."""
        size = float(np.linalg.norm(e))
        wanted = e * min(self._gain, self._most / max(size, 1e-300))
        root = np.linalg.cholesky(self._M)
        U, s, Vt = np.linalg.svd(J @ root, full_matrices=False)
        damping = np.maximum(self._least**2 - s * s, 0.0)
        v = root @ (Vt.T @ (s / np.maximum(s * s + damping, 1e-300) * (U.T @ wanted)))
        if not self._learns:
            return np.asarray(v)
        return np.asarray(v / max(1.0, float((np.abs(v) / self._v_max).max())))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LearnedRun:
    """A motion under a ``LearnedLaw``.

    Attributes:
        q: Where the arm ended, (nv,) [rad or m].
        error: |e| there [m].
        t: Times, (K,) [s].
        errors: |e| at those times, (K,) [m].
        path: Configurations, (K, nv) [rad or m].
        theta: What was learned by the end, (nv,).
    """

    q: FloatArray
    error: float
    t: FloatArray
    errors: FloatArray
    path: FloatArray
    theta: FloatArray

    def settled(self, within: float) -> float | None:
        """`settling_time`, as it was called before 0.4."""
        warn("settled() is called settling_time() now", DeprecationWarning, stacklevel=2)
        return self.settling_time(within)

    def settling_time(self, within: float) -> float | None:
        """When |e| fell below a bound for good [s]; None where it did not.

        Args:
            within: The bound [m].
        """
        above = np.flatnonzero(self.errors > within)
        if not len(above):
            return 0.0
        return None if above[-1] + 1 == len(self.t) else float(self.t[above[-1] + 1])


def learned_run(
    robot: Robot,
    goal: Any,
    q0: Any,
    locked: Iterable[str | int] = (),
    *,
    duration: float = 60.0,
    dt: float = 0.01,
    noise: float = 0.0,
    seed: int = 0,
    **settings: Any,
) -> LearnedRun:
    """The motion of an arm whose joints are locked from the start, under a ``LearnedLaw``, unreported.

    Args:
        robot: The arm.
        goal: Where the end effector is to go.
        q0: Where the arm starts, (nv,) [rad or m].
        locked: Names or 0-based indices of the locked joints.
        duration: How long, > 0 [s].
        dt: The sampling period, > 0 [s].
        noise: Standard deviation of the measured tip, >= 0 [m].
        seed: Of the noise.
        settings: More of ``LearnedLaw``.

    Raises:
        InputError: As ``LearnedLaw``, an unknown joint, or a wrong shape of q0.
    """
    law = LearnedLaw(robot, goal, dt=dt, noise=noise, **settings)
    q = robot.angles(q0)
    works = np.ones(robot.nv)
    works[[robot.joint(joint) for joint in locked]] = 0.0
    count = round(positive("duration", duration, "s") / dt)
    if count < 1:
        raise InputError(f"duration is {duration:g} s, expected at least one step of {dt:g} s")
    generator = np.random.default_rng(seed)
    path, errors = np.empty((count + 1, robot.nv)), np.empty(count + 1)
    for k in range(count + 1):
        e = law.error(q)
        path[k], errors[k] = q, np.linalg.norm(e)
        seen = e + noise * generator.standard_normal(len(e)) if noise else None
        q = q + dt * works * law.command(q, seen)
    return LearnedRun(
        q=path[-1].copy(),
        error=float(errors[-1]),
        t=np.asarray(dt * np.arange(count + 1.0)),
        errors=errors,
        path=path,
        theta=law.theta,
    )
