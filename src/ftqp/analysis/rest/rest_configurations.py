"""Where an arm can come to rest with a joint locked at a given value, off its goal."""

from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from ftqp.analysis.circular_intervals import TURN, wrapped
from ftqp.analysis.goals import GoalStudy, goal_study
from ftqp.analysis.outcomes.unaware_law import weights_inverse
from ftqp.analysis.rest.linearisation import RestKind, eigenvalues_at, kind_of, weighted_inverse
from ftqp.analysis.rest.rest_tracing import RestEquations
from ftqp.core.checks import BoolArray, FloatArray, frozen
from ftqp.core.errors import InputError
from ftqp.model.robot import Robot

SAME = 1e-5
"""Configurations nearer than this are one [rad or m]."""


def distinct(q: FloatArray, turns: BoolArray) -> FloatArray:
    """One of each set of configurations that are the same up to whole turns, (k, n) [rad or m]."""
    kept: list[FloatArray] = []
    for one in q:
        if all(np.abs(np.where(turns, wrapped(d), d)).max() > SAME for d in (one - other for other in kept)):
            kept.append(one)
    return np.array(kept).reshape(-1, len(turns))


STARTS = 512
"""From which rests are looked for: planar arms of three joints and random goals have none that they miss."""
AT_GOAL = 1e-7
"""Error below which a configuration is at the goal, no rest off it [m]."""
SINGULAR = 1e-9
"""det(A A') by sigma_max^2m below which a configuration is singular."""
RESTING = 1e-7
"""Share of the command to moving joints that counts as none."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RestConfiguration:
    """A configuration at which the arm rests off its goal, commanding the locked joint alone.

    Attributes:
        q: The configuration, (nv,) [rad or m].
        error: |e| there [m], angular rows times the characteristic length.
        alpha: What of the error goes along the locked joint's column, e = alpha a_i [rad or m].
        eigenvalues: Of the linearisation over the other joints, (nv - 1,) [1/s at a gain of 1/s]. Joints that
            never move the task rows are left out; they stand at their neutral values.
        kind: ``sink``, ``saddle``, ``source`` or ``degenerate``, by all eigenvalues.
    """

    q: FloatArray
    error: float
    alpha: float
    eigenvalues: NDArray[np.complex128]
    kind: RestKind


def rest_configurations(
    robot: Robot, goal: Any, joint: str | int, value: float, W: Any = None, rows: Any = "position"
) -> list[RestConfiguration]:
    """Where the arm can come to rest off its goal with a joint locked at a value that nobody knows of.

    What 512 quasi-random starts find: of planar arms of three joints all that a search on a fine grid finds,
    of other arms most, but not certainly all. Rests outside joint limits are left out.
    Source: goel2005; docs/theory/unidentified-failures.md, "Rest".

    Args:
        robot: The arm.
        goal: A pose (4, 4), or a point (2,) or (3,) where no rotation counts [m]; it may be out of reach.
        joint: Name or 0-based index of the locked joint.
        value: Where it is locked [rad or m].
        W: Weights of the joint rates, symmetric positive definite (nv, nv), or their diagonal; None is 1.
        rows: ``"pose"`` or ``"position"``, which are those of the robot's own rows, or names of rows.

    Raises:
        InputError: W is not positive definite, the joint is unknown, the value is not finite, the goal does
            not fit the rows, or the arm has no joint to spare.
    """
    study, M, i = rest_study(robot, goal, joint, W, rows)
    if not np.isfinite(value):
        raise InputError(f"value is {value}, expected a finite position of {robot.joints[i]}")
    q = rests_at(study, M, i, float(value))
    return [described(study, M, i, one) for one in q[inside_limits(study, q, i)]]


def rests_at(study: GoalStudy, M: FloatArray, i: int, value: float) -> FloatArray:
    """Regular rests off the goal with joint i locked at a value, each once, wherever limits are, (k, n)."""
    equations = RestEquations(study, M, i)
    starts = study.starts(STARTS)
    starts[:, i] = value
    z, done = equations.solved(equations.started(starts), held=True)
    return distinct(_regular(study, M, i, z[done][:, : study.robot.nv]), ~study.robot.chain.prismatic)


def rest_study(
    robot: Robot, goal: Any, joint: str | int, W: Any, rows: Any
) -> tuple[GoalStudy, FloatArray, int]:
    """The study of a goal, W^-1 and the index of the locked joint, checked; see ``rest_configurations``."""
    study = goal_study(robot, goal, rows)
    i, M = robot.joint(joint), weights_inverse(W, robot.nv)
    if study.redundancy < 1:
        raise InputError(
            f"{robot.name} has {robot.nv} joints and the task {study.m} rows, so a locked joint leaves too "
            "few; expected at least one joint more than rows"
        )
    return study, M, i


def described(study: GoalStudy, M: FloatArray, i: int, q: FloatArray) -> RestConfiguration:
    """What there is to say of a rest."""
    e, A, _, _ = study.free.values(q[None])
    a = A[0, :, i]
    eigenvalues = eigenvalues_at(study, M, q[None], i)[0]
    return RestConfiguration(
        q=frozen(q.copy()),
        error=float(np.linalg.norm(e[0])),
        alpha=float(a @ e[0] / (a @ a)),
        eigenvalues=eigenvalues[np.argsort(eigenvalues.real)],
        kind=kind_of(eigenvalues),
    )


def inside_limits(study: GoalStudy, q: FloatArray, but: int | None = None) -> BoolArray:
    """Which configurations are within the limits of the joints, up to whole turns, (k,)."""
    limits, slides = study.robot.limits, study.robot.chain.prismatic
    both = np.isfinite(limits.q_min) & np.isfinite(limits.q_max)
    low, high = np.where(both, limits.q_min, 0.0), np.where(both, limits.q_max, 0.0)
    turned = np.mod(q - low, TURN) <= high - low
    within = (q >= limits.q_min) & (q <= limits.q_max)
    inside = np.where(slides | ~both, within, turned)
    if but is not None:
        inside[:, but] = True
    return np.asarray(inside.all(axis=1))


def _regular(study: GoalStudy, M: FloatArray, i: int, q: FloatArray) -> FloatArray:
    """Those of some configurations that are off the goal, regular, and command joint i alone, (k, n)."""
    e, A, _, _ = study.free.values(q)
    sigma = np.linalg.svd(A, compute_uv=False)
    regular = (sigma**2).prod(axis=1) > SINGULAR * sigma[:, 0] ** (2 * study.m)
    regular &= np.linalg.norm(e, axis=1) > AT_GOAL
    q, e, A = q[regular], e[regular], A[regular]
    command = (weighted_inverse(A, M) @ e[:, :, None])[:, :, 0]
    others = np.delete(command, i, axis=1)
    return np.asarray(q[np.linalg.norm(others, axis=1) < RESTING * np.linalg.norm(command, axis=1)])
