"""Self-motions within joint limits: the pieces of the curves that an arm without limits would follow."""

from itertools import islice, product

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.spatial import cKDTree

from ftqp.analysis.circular_intervals import TURN, wrapped
from ftqp.analysis.goals import STEP, GoalStudy
from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.study_session import TracedCurve

MOST_COPIES = 64
"""Copies of a configuration, by full turns of its joints, that are looked at."""


def limited_curves(study: GoalStudy, curves: list[TracedCurve]) -> list[TracedCurve]:
    """All pieces within the robot's limits of curves that were traced without them.

    A joint whose range is more than a turn has several copies of a value; each piece is found with each.
    """
    pieces: list[TracedCurve] = []
    for curve in curves:
        copies = [copy for point in _inside(study, curve.q) for copy in _copies(study, point)]
        waiting = np.array(copies).reshape(-1, study.robot.nv)
        for piece in pieces:
            waiting = beside(study, piece.q, waiting)
        while len(waiting):
            piece = study.limited.curve(waiting[0])
            waiting = waiting[1:]
            if len(piece.q) > 1:
                pieces.append(piece)
                waiting = beside(study, piece.q, waiting)
    return pieces


def _excess(study: GoalStudy, q: FloatArray) -> FloatArray:
    """How far the worst joint is outside its limits, whole turns left out, (k,); negative inside."""
    limits = study.robot.limits
    finite = np.isfinite(limits.q_min) & np.isfinite(limits.q_max)
    low, high = np.where(finite, limits.q_min, 0.0), np.where(finite, limits.q_max, 0.0)
    half = np.where(finite, 0.5 * (high - low), np.inf)
    away = q - 0.5 * (low + high)
    turns = ~study.robot.chain.prismatic & finite
    away = np.where(turns, wrapped(away), away)
    one_sided = np.maximum(limits.q_min - q, q - limits.q_max)
    return np.asarray(np.where(finite, np.abs(away) - half, one_sided).max(axis=1))


def _inside(study: GoalStudy, q: FloatArray) -> FloatArray:
    """Points of a curve inside the limits: those of its samples, and ones of pieces between samples."""
    excess = _excess(study, q)
    found = [q[excess <= 0.0]]
    for k in range(1, len(q) - 1):
        if 0.0 < excess[k] < STEP and excess[k] <= min(excess[k - 1], excess[k + 1]):
            ends = q[k - 1], q[k + 1]

            def between(share: float, ends: tuple[FloatArray, FloatArray] = ends) -> FloatArray:
                return study.free.solutions((ends[0] + share * (ends[1] - ends[0]))[None], near=True)[0]

            best = minimize_scalar(
                lambda share, between=between: float(_excess(study, between(share))[0]),
                bounds=(0.0, 1.0),
                method="bounded",
            )
            if best.fun < 0.0:
                found.append(between(float(best.x)))
    return np.vstack(found)


def _copies(study: GoalStudy, q: FloatArray) -> list[FloatArray]:
    """The configuration with whole turns added, wherever the limits allow it."""
    limits, choices = study.robot.limits, []
    for i, value in enumerate(q):
        if study.turning[i] or study.robot.chain.prismatic[i]:
            choices.append([value])
            continue
        first = np.ceil((limits.q_min[i] - value) / TURN)
        last = np.floor((limits.q_max[i] - value) / TURN)
        if not np.isfinite(first + last):
            first = last = 0.0
        choices.append([value + TURN * k for k in np.arange(first, last + 1.0)])
    return [np.array(copy) for copy in islice(product(*choices), MOST_COPIES)]


def beside(study: GoalStudy, known: FloatArray, q: FloatArray, reach: float = 2.0 * STEP) -> FloatArray:
    """The configurations that are farther than a reach from all known ones, (k, nv) [rad or m]."""
    tree = cKDTree(turned(study, known), boxsize=np.where(study.turning, TURN, 0.0))
    away, _ = tree.query(turned(study, q), distance_upper_bound=reach)
    return np.asarray(q[~np.isfinite(away)])


def turned(study: GoalStudy, q: FloatArray) -> FloatArray:
    """Configurations with the values of joints without limits in [0, 2 pi)."""
    values = np.mod(q, TURN)
    return np.asarray(np.where(study.turning, np.where(values >= TURN, 0.0, values), q))
