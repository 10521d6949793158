"""Whether an arm rests that goes on commanding locked joints, and what kind of rest it is."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from ftqp.analysis.goals import GoalStudy, goal_study
from ftqp.analysis.outcomes.unaware_law import locked_joints, weights_inverse
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


NEUTRAL = 1e-8
"""Share of the largest eigenvalue below which a real part counts as zero."""


class RestKind(StrEnum):
    """What a rest does with configurations near it."""

    SINK = "sink"
    SADDLE = "saddle"
    SOURCE = "source"
    DEGENERATE = "degenerate"
    OUTSIDE = "outside"


def eigenvalues_at(study: GoalStudy, M: FloatArray, q: FloatArray, i: int) -> NDArray[np.complex128]:
    """The eigenvalues with joint i locked, (k, n - 1) [1/s at a gain of 1/s], of joints that matter."""
    return np.asarray(
        np.linalg.eigvals(reduced_jacobians(study, M, q, [i, *still_joints(study, M)])), dtype=np.complex128
    )


def kind_of(eigenvalues: NDArray[np.complex128]) -> RestKind:
    """The kind of a rest by the real parts of all its eigenvalues.

    A sign of the determinant alone, as in goel2005, misses pairs that cross the imaginary axis, and all
    eigenvalues that change sign together where J is singular.
    """
    if is_neutral(eigenvalues):
        return RestKind.DEGENERATE
    return kind_by_signs(eigenvalues)


def is_neutral(eigenvalues: NDArray[np.complex128]) -> bool:
    """Whether a real part is zero beside the largest eigenvalue."""
    return bool(np.abs(eigenvalues.real).min() < NEUTRAL * np.abs(eigenvalues).max())


def kind_by_signs(eigenvalues: NDArray[np.complex128]) -> RestKind:
    """Sink, saddle or source, by the signs of the real parts alone."""
    real = eigenvalues.real
    positive = int((real > 0.0).sum())
    if positive == 0:
        return RestKind.SINK
    return RestKind.SOURCE if positive == len(real) else RestKind.SADDLE


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class RestTest:
    """The residuals of a rest of q' = I_S G e; all without unit, 0 where a condition holds.

    Attributes:
        full_rank: sigma_min/sigma_max of J: the law is defined where it is not 0.
        collinear: How far the error is from the span of the locked joints' columns, relative to the error.
        rank: sigma_min of J W^-1 without the columns of locked joints, over sigma_max of J.
        rest: |I_S G e|/|G e|, the share of the command that goes to joints that move: the truth, which
            ``collinear`` and ``rank`` explain. It is nan where J is singular off the goal.
    """

    full_rank: float
    collinear: float
    rank: float
    rest: float

    def passes(self, tolerance: float = 1e-8) -> bool:
        """Whether the arm rests there, and J is regular.

        Args:
            tolerance: The largest share of the command to moving joints that counts as none.
        """
        return self.full_rank > SINGULAR and self.rest < tolerance


def rest_test(
    robot: Robot,
    q: Any,
    locked: str | int | Sequence[str | int],
    goal: Any,
    W: Any = None,
    rows: Any = "position",
) -> RestTest:
    """Whether an arm whose joints S are locked and commanded all the same rests at q, and why.

    G e is in the span of the locked joints just where e = sum a_i j_i and N' W sum a_i e_i = 0, N the null
    space. For one locked joint and e not 0, that is: e along j_i, and J W^-1 without column i rank deficient.
    For several, both conditions are necessary only. The first theorem of goel2005 leaves the second out.
    Source: goel2005, corrected; docs/theory/unidentified-failures.md, "Rest".

    Args:
        robot: The arm.
        q: The configuration, (nv,) or (nq,) [rad or m].
        locked: The joint that is locked, by name or 0-based index, or several.
        goal: A pose (4, 4), or a point (2,) or (3,) where no rotation counts [m].
        W: Weights of the joint rates, symmetric positive definite (nv, nv), or their diagonal; None is 1.
        rows: ``"pose"`` or ``"position"``, which are those of the robot's own rows, or names of rows.

    Raises:
        InputError: W is not positive definite, a joint is unknown, or the goal does not fit the rows.
    """
    study = goal_study(robot, goal, rows)
    held = list(locked_joints(robot, locked))
    if not held:
        raise InputError(f"locked is {locked!r}, expected at least one joint of {robot.name}")
    M = weights_inverse(W, robot.nv)
    e, A = (value[0] for value in study.free.values(robot.angles(q)[None])[:2])
    sigma = np.linalg.svd(A, compute_uv=False)
    size = float(np.linalg.norm(e))
    part = A[:, held] @ np.linalg.lstsq(A[:, held], e, rcond=None)[0]
    left = np.delete(A @ M, held, axis=1) / np.trace(M) * len(M)
    enough = left.shape[1] >= study.m
    rest = 0.0 if size <= study.tolerance else float("nan")
    if size > study.tolerance and sigma[-1] > SINGULAR * sigma[0]:
        command = weighted_inverse(A, M) @ e
        rest = float(np.linalg.norm(np.delete(command, held)) / np.linalg.norm(command))
    return RestTest(
        full_rank=float(sigma[-1] / sigma[0]),
        collinear=float(np.linalg.norm(e - part)) / size if size > study.tolerance else 0.0,
        rank=float(np.linalg.svd(left, compute_uv=False)[-1] / sigma[0]) if enough else 0.0,
        rest=rest,
    )
