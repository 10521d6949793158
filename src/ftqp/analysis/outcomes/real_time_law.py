"""The point-to-point law in real time, its rates from the closed form or from any controller."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from scipy.integrate import solve_ivp

from ftqp.analysis.goals import goal_study
from ftqp.analysis.outcomes.after_failure import locked_joints
from ftqp.analysis.outcomes.unaware_law import UnawareLaw
from ftqp.analysis.outcomes.weights import weights_inverse
from ftqp.analysis.spatial_map import whole_number
from ftqp.core.checks import FloatArray, frozen, positive
from ftqp.core.errors import InputError
from ftqp.model.robot import Robot
from ftqp.qp import QP, SolveStatus, solve

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
        W: Weights of the joint rates, (nv, nv) or its diagonal (nv,); None is the identity. A controller has
            its own.
        gain: K_e, > 0 [1/s].
        v_max: The largest commanded speed of the task, > 0 [m/s]; None is no limit.
        controller: What resolves the commanded rate of the task, for example ``qp_rates(W)``; None is the
            closed form G.
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


def qp_rates(W: Any, nv: int, backend: str = "active_set") -> Controller:
    """Rates from min 1/2 v'Wv subject to A v = the commanded rate: the same law, by a QP.

    Args:
        W: Weights, (nv, nv) or its diagonal (nv,), positive definite; None is the identity.
        nv: Number of joints.
        backend: The solver.
    """
    H = np.linalg.inv(weights_inverse(W, nv))

    def rates(A: FloatArray, wanted: FloatArray) -> FloatArray:
        found = solve(QP(H, np.zeros(nv), A=A, b=wanted), backend=backend)
        if found.status != SolveStatus.SOLVED:
            raise InputError(f"{backend} found no rates ({found.status.name}); the Jacobian may be singular")
        return found.x

    return rates
