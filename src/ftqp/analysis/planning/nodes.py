"""Nodes of a plan: configurations with which an arm can be at each waypoint of a path."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.manifolds.manifold import beside, turned
from ftqp.core.checks import BoolArray, FloatArray
from ftqp.kernel.entry.study_session import TracedCurve

RANDOM_STARTS = 64
"""Random starts at every waypoint; curves of a Panda are found from fewer than 20."""
EVERY = 4
"""Each so-many-th node of the waypoint before is a start, too."""
CURVES = 256
"""Curves of a waypoint at most."""
SHORTEST = 1e-3
"""A curve that is cut and shorter is left out [rad or m]: it grazes a limit."""


class _Curve(NamedTuple):
    """Points of a self-motion, (k, nv) [rad or m], and arc lengths of the segments that end in them, (k,)."""

    q: FloatArray
    parts: FloatArray


def curve_nodes(
    study: GoalStudy,
    poses: FloatArray,
    *,
    spacing: float,
    seed: int,
    q0: FloatArray | None = None,
    notify: Callable[[int], None] | None = None,
) -> list[FloatArray]:
    """Nodes on all self-motion curves within the limits at each waypoint, one joint being to spare.

    Curves are traced from random starts and from nodes of the waypoint before; then, from the last waypoint
    to the first, from nodes of the waypoint behind. Source: docs/theory/fault-tolerant-plans.md, "Nodes".
    """
    nv, K = study.robot.nv, len(poses)
    random = _random_starts(study, np.random.default_rng(seed), len(poses))
    layers: list[list[_Curve]] = []
    before = np.empty((0, nv)) if q0 is None else q0[None]
    for k, pose in enumerate(poses):
        starts = np.vstack([before, random[k]])
        study.limited.aim(pose)
        layers.append(_long(study.limited.self_motions(starts, quiet=_NEVER, curves=CURVES)))
        before = _starts(layers[-1], nv)
        if notify is not None:
            notify(k + 1)
    for k in range(K - 2, -1, -1):
        more = _missing(study, poses[k], layers[k], _starts(layers[k + 1], nv), spacing)
        layers[k] = layers[k] + _long(more)
    nodes = [_nodes(study, curves, spacing) for curves in layers]
    if q0 is not None:
        nodes[0] = np.vstack([turned(study, q0[None]), nodes[0]])
    return nodes


_NEVER = 1 << 40
"""The search does not end early."""


def _random_starts(study: GoalStudy, random: np.random.Generator, count: int) -> FloatArray:
    """Starts of each waypoint, evenly spread within the limits, (count, RANDOM_STARTS, nv)."""
    box = study.starts(1 << 10, limited=True)
    low, high = box.min(axis=0), box.max(axis=0)
    return random.uniform(low, high, (count, RANDOM_STARTS, study.robot.nv))


def _long(curves: Sequence[TracedCurve]) -> list[_Curve]:
    """Those curves that are long enough."""
    return [_Curve(one.q, one.parts) for one in curves if len(one.q) > 1 and one.length > SHORTEST]


def _starts(curves: Sequence[_Curve], nv: int) -> FloatArray:
    """Some nodes of each curve."""
    return np.vstack([np.empty((0, nv)), *(curve.q[::EVERY] for curve in curves)])


def _missing(
    study: GoalStudy, pose: FloatArray, curves: Sequence[_Curve], starts: FloatArray, spacing: float
) -> list[TracedCurve]:
    """Self-motions at a waypoint through the starts, but for those that are known."""
    session, limits = study.limited, study.robot.limits
    if not len(starts):
        return []
    session.aim(pose)
    q, left, _ = session.solutions(starts, near=True)
    inside = (q >= limits.q_min).all(axis=1) & (q <= limits.q_max).all(axis=1)
    waiting = q[(left <= study.tolerance) & inside]
    found: list[TracedCurve] = []
    for curve in curves:
        waiting = beside(study, curve.q, waiting, 2.0 * spacing)
    while len(waiting):
        traced = session.curve(waiting[0])
        waiting = beside(study, traced.q, waiting[1:], 2.0 * spacing) if len(traced.q) else waiting[1:]
        found.append(traced)
    return found


def _nodes(study: GoalStudy, curves: Sequence[_Curve], spacing: float) -> FloatArray:
    """Points of all curves, about a spacing apart, (M, nv)."""
    parts = [np.empty((0, study.robot.nv))]
    for curve in curves:
        arcs = np.concatenate([[0.0], np.cumsum(curve.parts[1:])])
        _, first = np.unique(np.floor(arcs / spacing + 1e-9), return_index=True)
        parts.append(curve.q[first])
    return turned(study, np.vstack(parts))


SHARE_OF_REACH = 0.7
"""A wandering node goes this share of what its joints can turn between waypoints."""
HEADING = 6
"""A wandering node keeps its heading for so many waypoints."""


def sampled_nodes(
    study: GoalStudy,
    poses: FloatArray,
    *,
    count: int,
    reach: FloatArray,
    seed: int,
    q0: FloatArray | None = None,
    notify: Callable[[int], None] | None = None,
) -> list[FloatArray]:
    """Nodes at each waypoint: solutions from random starts, each carried from waypoint to waypoint.

    Half of the nodes go on with the least motion, the others wander along the self-motion as far as speeds
    allow; one that cannot go on, being at a limit, begins anew beside another.
    Source: docs/theory/fault-tolerant-plans.md, "Nodes".
    """
    random = np.random.default_rng(seed)
    q = _first_nodes(study, poses[0], count, q0, random)
    nodes = [turned(study, q)]
    wanders = np.arange(len(q)) % 2 == 1
    heading = random.standard_normal(q.shape)
    for k, pose in enumerate(poses[1:], start=1):
        if not len(q):
            nodes.append(q)
            continue
        if k % HEADING == 0:
            heading = random.standard_normal(q.shape)
        study.limited.aim(pose)
        ahead, kept = _carried(study, q)
        step = _along_self_motion(study, ahead, heading) * (SHARE_OF_REACH * reach.min())
        aside, beside = _carried(study, np.where(wanders[:, None], ahead + step, ahead))
        take = wanders & beside & (np.abs(aside - q) <= reach).all(axis=1)
        ahead = np.where(take[:, None], aside, ahead)
        heading[wanders & ~take] *= -1.0
        q = _revived(study, ahead, kept, heading, random)
        nodes.append(turned(study, q))
        if notify is not None:
            notify(k + 1)
    return nodes


def _first_nodes(
    study: GoalStudy, pose: FloatArray, count: int, q0: FloatArray | None, random: np.random.Generator
) -> FloatArray:
    """Solutions of the first waypoint, (count, nv) or fewer."""
    box = study.starts(1 << 10, limited=True)
    starts = random.uniform(box.min(axis=0), box.max(axis=0), (4 * count, study.robot.nv))
    study.limited.aim(pose)
    q, left, _ = study.limited.solutions(starts, bounded=True)
    found = q[left <= study.tolerance][:count]
    if q0 is None:
        return np.asarray(found)
    own = np.tile(q0, (max(1, count // 4), 1))
    return np.vstack([own, found[: count - len(own)]])


def _carried(study: GoalStudy, q: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Configurations brought to the goal that is aimed at, and which of them are there within limits."""
    limits = study.robot.limits
    exact, left, _ = study.limited.solutions(q, near=True)
    inside = (exact >= limits.q_min).all(axis=1) & (exact <= limits.q_max).all(axis=1)
    return exact, np.asarray((left <= study.tolerance) & inside)


def _along_self_motion(study: GoalStudy, q: FloatArray, heading: FloatArray) -> FloatArray:
    """The headings' parts in the null space of the task's Jacobian, the largest entry of each 1."""
    A = study.limited.values(q)[1]
    _, _, V = np.linalg.svd(A)
    null = V[:, study.m :]
    step = np.einsum("kri,kr->ki", null, np.einsum("kri,ki->kr", null, heading))
    return np.asarray(step / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-12))


def _revived(
    study: GoalStudy, q: FloatArray, kept: BoolArray, heading: FloatArray, random: np.random.Generator
) -> FloatArray:
    """Nodes in place of those that were lost: a step along the self-motion beside ones that go on."""
    if kept.all() or not kept.any():
        return q if kept.all() else q[:0]
    lost = np.flatnonzero(~kept)
    beside = random.choice(np.flatnonzero(kept), len(lost))
    heading[lost] = random.standard_normal((len(lost), study.robot.nv))
    size = random.uniform(0.0, 0.3, (len(lost), 1))
    aside, fine = _carried(study, q[beside] + size * _along_self_motion(study, q[beside], heading[lost]))
    q = q.copy()
    q[lost] = np.where(fine[:, None], aside, q[beside])
    return q
