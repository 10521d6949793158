"""Nodes of a plan: all configurations, to a spacing, with which an arm can be at each waypoint of a path."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.spatial import cKDTree

from ftqp.analysis.circular_intervals import TURN
from ftqp.analysis.goals import GoalStudy
from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.study_session import TracedCurve

RANDOM_STARTS = 64
"""Random starts at every waypoint; curves of a Panda are found from fewer than 20."""
EVERY = 4
"""Each so-many-th node of the waypoint before is a start, too."""
CURVES = 256
"""Curves of a waypoint at most."""
SHORTEST = 1e-3
"""A curve that is cut and shorter is left out [rad or m]: it grazes a limit."""


def curve_nodes(
    study: GoalStudy,
    poses: FloatArray,
    *,
    spacing: float,
    seed: int,
    q0: FloatArray | None = None,
    told: Callable[[int], None] | None = None,
) -> list[FloatArray]:
    """Nodes on all self-motion curves within the limits at each waypoint, one joint being to spare.

    Curves are traced from random starts and from nodes of the waypoint before; then, from the last waypoint
    to the first, from nodes of the waypoint behind. Source: docs/theory/fault-tolerant-plans.md, "Nodes".

    Args:
        study: Of the arm and the task rows, with steps of the spacing.
        poses: Waypoints, (K + 1, 4, 4).
        spacing: Arc length between nodes [rad or m]. Smaller ones are more nodes and a finer choice; the
            work grows with 1 / spacing.
        seed: Of the random starts.
        q0: A configuration at the first waypoint that becomes its first node, (nv,) [rad or m].
        told: Called with the number of waypoints that are done.

    Returns:
        For each waypoint its nodes, (M, nv) [rad or m]; values of joints without limits in [0, 2 pi).
    """
    session, nv = study.limited, study.robot.nv
    random = _random_starts(study, np.random.default_rng(seed), len(poses))
    layers: list[list[TracedCurve]] = []
    before = np.empty((0, nv)) if q0 is None else q0[None]
    for k, pose in enumerate(poses):
        session.aim(pose)
        found = session.self_motions(np.vstack([before, random[k]]), quiet=_NEVER, curves=CURVES)
        layers.append([curve for curve in found if len(curve.q) > 1 and curve.length > SHORTEST])
        before = _starts(layers[-1], nv)
        if told is not None:
            told(k + 1)
    for k in range(len(poses) - 2, -1, -1):
        session.aim(poses[k])
        layers[k] += _missing(study, layers[k], _starts(layers[k + 1], nv), spacing)
    nodes = [_nodes(study, curves, spacing) for curves in layers]
    if q0 is not None:
        nodes[0] = np.vstack([turned(study, q0[None]), nodes[0]])
    return nodes


_NEVER = 1 << 40
"""The search does not end early."""


def turned(study: GoalStudy, q: FloatArray) -> FloatArray:
    """Configurations with the values of joints without limits in [0, 2 pi).

    Args:
        study: Of the arm.
        q: Configurations, (k, nv) [rad or m].
    """
    values = np.mod(q, TURN)
    return np.asarray(np.where(study.turning, np.where(values >= TURN, 0.0, values), q))


def _random_starts(study: GoalStudy, random: np.random.Generator, count: int) -> FloatArray:
    """Starts of each waypoint, evenly spread within the limits, (count, RANDOM_STARTS, nv)."""
    box = study.starts(1 << 10, limited=True)
    low, high = box.min(axis=0), box.max(axis=0)
    return random.uniform(low, high, (count, RANDOM_STARTS, study.robot.nv))


def _starts(curves: Sequence[TracedCurve], nv: int) -> FloatArray:
    """Some nodes of each curve."""
    return np.vstack([np.empty((0, nv)), *(curve.q[::EVERY] for curve in curves)])


def _missing(
    study: GoalStudy, curves: Sequence[TracedCurve], starts: FloatArray, spacing: float
) -> list[TracedCurve]:
    """Curves of the goal that is aimed at through the starts, but for those that are known."""
    session, limits = study.limited, study.robot.limits
    if not len(starts):
        return []
    q, left, _ = session.solutions(starts, near=True)
    inside = (q >= limits.q_min).all(axis=1) & (q <= limits.q_max).all(axis=1)
    waiting, found = q[(left <= study.tolerance) & inside], []
    for curve in curves:
        waiting = _beside(study, curve.q, waiting, 2.0 * spacing)
    while len(waiting):
        curve = session.curve(waiting[0])
        waiting = _beside(study, curve.q, waiting[1:], 2.0 * spacing) if len(curve.q) else waiting[1:]
        if len(curve.q) > 1 and curve.length > SHORTEST:
            found.append(curve)
    return found


def _beside(study: GoalStudy, known: FloatArray, q: FloatArray, reach: float) -> FloatArray:
    """The configurations that are farther than a reach from all known ones, (k, nv)."""
    tree = cKDTree(turned(study, known), boxsize=np.where(study.turning, TURN, 0.0))
    away, _ = tree.query(turned(study, q), distance_upper_bound=reach)
    return np.asarray(q[~np.isfinite(away)])


def _nodes(study: GoalStudy, curves: Sequence[TracedCurve], spacing: float) -> FloatArray:
    """Points of all curves, about a spacing apart, (M, nv)."""
    parts = [np.empty((0, study.robot.nv))]
    for curve in curves:
        arcs = np.concatenate([[0.0], np.cumsum(curve.parts[1:])])
        _, first = np.unique(np.floor(arcs / spacing + 1e-9), return_index=True)
        parts.append(curve.q[first])
    return turned(study, np.vstack(parts))
