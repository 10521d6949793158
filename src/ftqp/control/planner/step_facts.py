"""What a step can be asked for beside its command: how the QP went, and how near a singularity is."""

from typing import NamedTuple

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.qp.problem import SolveStatus


class Reference(NamedTuple):
    """A state of the arm that the planner commands.

    Attributes:
        q: Joint positions, (nv,) [rad or m].
        v: Joint velocities, (nv,) [rad/s or m/s].
        a: Joint accelerations of the step, (nv,) [rad/s2 or m/s2].
    """

    q: FloatArray
    v: FloatArray
    a: FloatArray


class QPReport(NamedTuple):
    """How the QP of a step went.

    Attributes:
        status: What the residuals made of the solver's answer; None when the step needed no task QP.
        iterations: Of the solver, in its own counting.
        residual: The largest of the scaled residuals below, of the QP that gave the command.
        residual_task: The largest error of a task row, slack counted, over 1 + the largest right side.
        residual_bounds: The largest violation of a row of C, over 1 + the largest entry of x.
        residual_dual: The largest error of stationarity, over 1 + the norm of its terms.
        time: Duration of the whole step [s], or None unless the planner was made with ``timing=True``.
    """

    status: SolveStatus | None
    iterations: int
    residual: float
    residual_task: float
    residual_bounds: float
    residual_dual: float
    time: float | None


class Measures(NamedTuple):
    """How near the arm is to losing a direction of its task.

    Attributes:
        sigma_min: Smallest singular value of the task's Jacobian over the working joints, metres by the
            length.
        manipulability: The product of all singular values.
        condition: The largest by the smallest; inf where a direction is lost.
    """

    sigma_min: float
    manipulability: float
    condition: float


def measures_of(jacobians: FloatArray, working: IntArray) -> FloatArray:
    """The numbers of ``Measures`` for many Jacobians, (K, 3).

    Args:
        jacobians: (K, m, nv), the columns of joints that do not work zero.
        working: how many joints work in each, (K,); with fewer than rows a direction is lost.
    """
    rows = jacobians.shape[-2]
    sigma = np.linalg.svd(jacobians, compute_uv=False)
    sigma[np.minimum(working, sigma.shape[1]) < rows] *= np.arange(sigma.shape[1]) < rows - 1
    least = sigma[:, rows - 1] if sigma.shape[1] >= rows else np.zeros(len(sigma))
    product = sigma[:, :rows].prod(axis=1) if sigma.shape[1] >= rows else np.zeros(len(sigma))
    with np.errstate(divide="ignore", invalid="ignore"):
        condition = np.where(least > 0.0, sigma[:, 0] / least, np.inf)
    return np.stack([least, product, condition], axis=1)
