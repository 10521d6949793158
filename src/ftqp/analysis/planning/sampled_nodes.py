"""Nodes of a plan where two or more joints are to spare: random samples, carried along the path."""

from collections.abc import Callable

import numpy as np

from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.manifolds.limited_curves import turned
from ftqp.core.checks import BoolArray, FloatArray

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
    told: Callable[[int], None] | None = None,
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
        if told is not None:
            told(k + 1)
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
