"""All self-motions of an arm at a pose."""

from typing import Any

import numpy as np

from ftqp.analysis.goals import GoalStudy, goal_study
from ftqp.analysis.manifolds.limited_curves import limited_curves
from ftqp.analysis.manifolds.manifold import Manifold, manifold_of, manifold_of_samples
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.kernel.entry.study_session import TracedCurve
from ftqp.kernel.layout.method_codes import CurveEnd
from ftqp.model.robot import Robot

STARTS = 2048
"""Starts from which solutions are looked for at most."""

QUIET = 100
"""The search for components ends when so many solutions in a row lay on known ones."""

POINT = 1e-4
"""A curve that does not close and is shorter is a point [rad or m]."""

SAMPLES = 512
"""Solutions that are looked for where self-motions are no curves."""


def self_motion(robot: Robot, pose: Any, rows: Any = "pose") -> list[Manifold]:
    """All self-motions at a pose: the configurations that keep the task rows there, one list entry each.

    With one joint more than task rows they are curves, traced to 1e-12: closed ones, or pieces between joint
    limits. Components are found from 2048 quasi-random starts, until 100 solutions in a row lay on known
    curves. With more joints there is one entry of up to 512 samples, and components are not told apart.
    Source: goel2005; docs/theory/unidentified-failures.md, "Self-motions".

    Args:
        robot: The arm.
        pose: The goal: a pose (4, 4), or a point (2,) or (3,) where no rotation counts [m].
        rows: ``"pose"`` or ``"position"``, which are those of the robot's own rows, or names of rows.

    Raises:
        InputError: The goal does not fit the rows or is outside the workspace, or no joint is to spare.
    """
    study = goal_study(robot, pose, rows)
    if study.redundancy < 1:
        raise InputError(
            f"{robot.name} has {robot.nv} joints and the task {study.m} rows, so it has no self-motion; "
            "expected at least one joint more than rows"
        )
    if study.redundancy == 1:
        return [manifold_of(study, curve) for curve in traced_curves(study)]
    return [manifold_of_samples(study, samples(study))]


def traced_curves(study: GoalStudy) -> list[TracedCurve]:
    """The self-motions of a goal of an arm with one joint to spare, as they were traced."""
    found = study.free.self_motions(study.starts(STARTS), quiet=QUIET)
    curves = [curve for curve in found if curve.end is CurveEnd.CLOSED or curve.length > POINT]
    if not curves:
        _, errors, _ = study.free.solutions(study.starts(256))
        if errors.min() > study.tolerance:
            raise study.unreachable(float(errors.min()))
        raise InputError(
            f"the goal is at the edge of the workspace of {study.robot.name}, where its self-motion is a "
            "point; expected a goal inside"
        )
    if study.has_limits:
        curves = limited_curves(study, curves)
        if not curves:
            raise InputError(
                f"the goal is reached by {study.robot.name} only outside its joint limits; "
                "expected a goal inside the workspace"
            )
    return curves


def samples(study: GoalStudy) -> FloatArray:
    """Solutions of a goal inside the joint limits, from evenly spread starts, (k, nv) [rad or m]."""
    q, errors, _ = study.limited.solutions(study.starts(SAMPLES, limited=True), bounded=True)
    done = errors <= study.tolerance
    if not done.any():
        raise study.unreachable(float(errors.min()))
    return np.asarray(q[done])
