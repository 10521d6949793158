"""How an arm moves near a configuration while joints are locked that it goes on commanding."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ftqp.analysis.goals import GoalStudy, goal_study
from ftqp.analysis.outcomes.weights import weights_inverse
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.model.robot import Robot

SINGULAR = 1e-6
"""Share of the largest singular value below which the task's Jacobian counts as singular."""


def weighted_inverse(A: FloatArray, M: FloatArray) -> FloatArray:
    """G = M A' (A M A')^-1 of Jacobians, (..., n, m), M the inverse of the weights."""
    MAt = M @ np.swapaxes(A, -1, -2)
    return np.asarray(np.swapaxes(np.linalg.solve(A @ MAt, np.swapaxes(MAt, -1, -2)), -1, -2))


def reduced_jacobians(study: GoalStudy, M: FloatArray, q: FloatArray, locked: Sequence[int]) -> FloatArray:
    """The linearisation of q' = I_S G e over the joints that move, (k, n - s, n - s) [1/s at a gain of 1/s].

    With lam = (A M A')^-1 e and c = M A' lam, in the derivatives by q_l

        dlam = (A M A')^-1 (de - dA c - A M dA' lam),   dc = M (dA' lam + A' dlam),   de = -D_l.

    Source: docs/theory/unidentified-failures.md, "Linearisation".
    """
    e, A, D, H = study.free.values(q, rates=True)
    MAt = M @ np.swapaxes(A, 1, 2)
    inverse = np.linalg.pinv(A @ MAt, rcond=0.0, hermitian=True)
    lam = np.einsum("kab,kb->ka", inverse, e)
    c = np.einsum("kia,ka->ki", MAt, lam)
    turned = np.einsum("klan,ka->kln", H, lam)
    right = -np.swapaxes(D, 1, 2) - np.einsum("klan,kn->kla", H, c)
    right -= np.einsum("kan,kln->kla", np.swapaxes(MAt, 1, 2), turned)
    rates = np.einsum("kab,klb->kla", inverse, right)
    dc = np.einsum("ij,klj->kil", M, turned) + np.einsum("kia,kla->kil", MAt, rates)
    moving = np.setdiff1d(np.arange(q.shape[1]), np.asarray(locked, dtype=np.int64))
    return np.asarray(dc[:, moving][:, :, moving])


def still_joints(study: GoalStudy, M: FloatArray) -> list[int]:
    """Joints that never move the task rows and are never commanded: where they stand does not matter."""
    return [k for k in study.idle if not np.delete(M[k], k).any()]


def convergence_rates(robot: Robot, q: Any, rows: Any = "position", W: Any = None) -> dict[str, float]:
    """How fast the arm converges at a goal after each joint alone has locked there and nobody knows.

    Along the slowest direction the error falls as exp(-rho_i K_e t), rho_i = 1 - (G J)_ii. For W = 1 this is
    det(J_i J_i')/det(J J'), J_i without column i: the square of the relative manipulability, in [0, 1].
    For weights that are not diagonal it can be negative: then the goal itself repels the arm.
    Source: goel2005; docs/theory/unidentified-failures.md, "At the goal".

    Args:
        robot: The arm.
        q: The configuration at the goal, (nv,) or (nq,) [rad or m].
        rows: ``"pose"`` or ``"position"``, which are those of the robot's own rows, or names of rows.
        W: Weights of the joint rates, symmetric positive definite (nv, nv), or their diagonal; None is 1.

    Returns:
        rho by joint name, without unit.

    Raises:
        InputError: W is not positive definite, or the configuration is singular.
    """
    study = goal_study(robot, robot.pose(q), rows)
    M = weights_inverse(W, robot.nv)
    A = regular_jacobian(study, robot.angles(q))
    rho = 1.0 - np.diag(weighted_inverse(A, M) @ A)
    return {joint: float(value) for joint, value in zip(robot.joints, rho, strict=True)}


def regular_jacobian(study: GoalStudy, q: FloatArray) -> FloatArray:
    """The task's Jacobian at a configuration, (m, n), angular rows scaled."""
    A: FloatArray = study.free.values(q[None])[1][0]
    sigma = np.linalg.svd(A, compute_uv=False)
    if len(A) > A.shape[1] or sigma[-1] <= SINGULAR * sigma[0]:
        raise InputError(
            f"{study.robot.name} is singular at q (sigma_min/sigma_max = {sigma[-1] / sigma[0]:.1e}), where "
            "the law is not defined; expected a regular configuration"
        )
    return A
