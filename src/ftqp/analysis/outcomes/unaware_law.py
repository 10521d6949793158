"""The resolved-rate law on an arm some of whose joints stand still without its knowing."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from scipy.integrate import solve_ivp

from ftqp.analysis.goals import GoalStudy, goal_study
from ftqp.core.checks import FloatArray, array, frozen, numbers, positive, whole_number
from ftqp.core.errors import InputError
from ftqp.kernel.layout.other_records import SHARE
from ftqp.model.robot import Robot


def weights_inverse(W: Any, n: int) -> FloatArray:
    """M = W^-1 of the weights of the joint rates, (n, n); None is the identity."""
    if W is None:
        return np.eye(n)
    W = numbers("W", W)
    given = np.diag(array("W", W, (n,), "(nv,)")) if W.ndim == 1 else array("W", W, (n, n), "(nv, nv)")
    if not np.allclose(given, given.T, rtol=1e-9, atol=1e-12 * float(np.abs(given).max())):
        raise InputError(
            "W is not symmetric, expected a symmetric positive definite matrix; use (W + W.T) / 2"
        )
    least, largest = np.linalg.eigvalsh(given)[[0, -1]]
    if not least > 1e-12 * max(largest, 1e-300):
        raise InputError(
            f"W has the eigenvalue {least:.3g}, expected a positive definite matrix; "
            "add a multiple of the identity"
        )
    inverse = np.linalg.inv(given)
    return np.asarray(0.5 * (inverse + inverse.T))


SINGULAR = 1e-12
"""A condition of A M A' beyond the inverse of this is singular to rounding: the least rates are taken."""


def locked_joints(robot: Robot, locked: str | int | Sequence[str | int]) -> tuple[int, ...]:
    """The indices of the joints that lock, or none."""
    given = [locked] if isinstance(locked, str | int | np.integer) else list(locked)
    which = tuple(sorted({robot.joint(joint) for joint in given}))
    if len(which) == robot.nv:
        raise InputError(f"locked names all {robot.nv} joints of {robot.name}; leave one that moves")
    return which


@final
class UnawareLaw:
    """v = I_S G kappa e, G = M A' (A M A')^-1, kappa = min(K_e, v_max / |e|), A the rows' Jacobian.

    Source: docs/theory/after-a-failure.md, "The law and its clock".
    """

    def __init__(
        self, study: GoalStudy, M: FloatArray, locked: Sequence[int], gain: float = 1.0, v_max: float = np.inf
    ) -> None:
        self._study, self._M, self._gain, self._v_max = study, M, gain, v_max
        self.free = np.ones(len(M), dtype=np.bool_)
        self.free[list(locked)] = False

    def values(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """e, (..., m), and A, (..., m, n), at configurations, (..., n)."""
        e, A, _, _ = self._study.free.values(np.atleast_2d(q))
        return (e, A) if q.ndim > 1 else (e[0], A[0])

    def sizes(self, q: FloatArray) -> FloatArray:
        """|e| [m]."""
        return np.asarray(np.linalg.norm(self.values(q)[0], axis=-1))

    def kappa(self, size: float) -> float:
        """The gain at an |e| [1/s]."""
        return self._gain if size * self._gain <= self._v_max else self._v_max / size

    def rates(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """I_S G e, (..., n) [rad or m], and |e| [m]: the motion with gain 1."""
        e, A = self.values(q)
        MAt = self._M @ np.swapaxes(A, -1, -2)
        v = MAt @ np.linalg.pinv(A @ MAt, rcond=SINGULAR, hermitian=True) @ e[..., None]
        return np.where(self.free, v[..., 0], 0.0), np.linalg.norm(e, axis=-1)

    def scaled(self, s: float, y: FloatArray) -> FloatArray:
        """d(q, t)/ds of the state (q, t), (n + 1,)."""
        v, size = self.rates(y[:-1])
        w = SHARE + float(np.linalg.norm(v))
        return np.append(v / w, 1.0 / (w * self.kappa(float(size))))

    def between(self, begin: FloatArray, end: FloatArray, length: float, share: Any) -> FloatArray:
        """The state (q, t) at shares, (..., 1), of the way between two so far apart in s, of third order."""
        rest, x, h = 1.0 - share, share, length
        first, last = self.scaled(0.0, begin), self.scaled(0.0, end)
        held = rest * rest * ((1.0 + 2.0 * x) * begin + x * h * first)
        return np.asarray(held + x * x * ((1.0 + 2.0 * rest) * end - rest * h * last))


TOLERANCE = 1e-11
"""Of a step [rad or m]."""

Controller = Callable[[FloatArray, FloatArray], FloatArray]
"""Joint rates (nv,) from the Jacobian of the task rows, (m, nv), and the commanded rate of the task, (m,)."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PointToPoint:
    """A motion.

    Attributes:
        t: Times, (k,) [s].
        q: Configurations, (k, nv) [rad or m].
        errors: |e|, angular rows times the characteristic length, (k,) [m].
    """

    t: FloatArray
    q: FloatArray
    errors: FloatArray


def point_to_point(
    robot: Robot,
    goal: Any,
    q0: Any,
    *,
    duration: float,
    locked: str | int | Sequence[str | int] = (),
    rows: Any = "position",
    W: Any = None,
    gain: float = 1.0,
    v_max: float | None = None,
    controller: Controller | None = None,
    samples: int = 200,
) -> PointToPoint:
    """The motion under v = I_S G kappa e, kappa = min(K_e, v_max / |e|), or under another controller.

    Source: docs/theory/after-a-failure.md, "The law and its clock".

    Args:
        robot: The arm.
        goal: A point, (2,) or (3,) [m], or a pose, (4, 4).
        q0: Where it begins, (nv,) or (nq,) [rad or m].
        duration: > 0 [s].
        locked: Joints that do not move, though they are commanded as before; none are healthy arms.
        rows: ``"position"``, ``"pose"``, or names of task rows.
        W: Weights of the joint rates, (nv, nv) or diagonal (nv,); None is 1. A controller has its own.
        gain: K_e, > 0 [1/s].
        v_max: The largest commanded speed of the task, > 0 [m/s]; None is no limit.
        controller: What resolves the task's rate; None is the closed form G.
        samples: How many equal parts of the time are given back, >= 1.

    Raises:
        InputError: A number is out of its range, there is no such joint, or W is not positive definite.
    """
    study = goal_study(robot, goal, rows)
    speed, end = positive("gain", gain, "1/s"), positive("duration", duration, "s")
    limit = np.inf if v_max is None else positive("v_max", v_max, "m/s")
    whole_number("samples", samples, 1)
    which = locked_joints(robot, locked)
    law = UnawareLaw(study, weights_inverse(W, robot.nv), which, speed, limit)

    def motion(t: float, q: FloatArray) -> FloatArray:
        if controller is None:
            v, size = law.rates(q)
            return np.asarray(law.kappa(float(size)) * v)
        e, A = law.values(q)
        wanted = law.kappa(float(np.linalg.norm(e))) * e
        return np.where(law.free, controller(A, wanted), 0.0)

    times = np.linspace(0.0, end, samples + 1)
    way = solve_ivp(
        motion, (0.0, end), robot.angles(q0), method="DOP853", t_eval=times, rtol=TOLERANCE, atol=TOLERANCE
    )
    if way.status != 0:
        raise InputError(
            f"the motion meets a singularity after {way.t[-1] if len(way.t) else 0.0:.4g} s; "
            "choose a shorter duration"
        )
    q = way.y.T.copy()
    return PointToPoint(t=frozen(way.t), q=frozen(q), errors=frozen(law.sizes(q)))
