"""Whether an arm rests that goes on commanding locked joints."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from ftqp.analysis.goals import goal_study
from ftqp.analysis.outcomes.after_failure import locked_joints
from ftqp.analysis.outcomes.weights import weights_inverse
from ftqp.analysis.rest.linearisation import SINGULAR, weighted_inverse
from ftqp.core.errors import InputError
from ftqp.model.robot import Robot


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
