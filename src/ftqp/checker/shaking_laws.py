"""The laws of calm: an arm whose target rests comes to rest, and no joint chatters, at rest or anywhere."""

from itertools import pairwise

import numpy as np

from ftqp.checker.joint_health import health, jumps
from ftqp.checker.model_file import ModelFile
from ftqp.checker.trace import Strictness, Trace
from ftqp.core.checks import FloatArray

SMOOTH = 0.02
"""What shakes a joint by less than this long is noise and goes nowhere [s]."""
STILL = 0.01
"""A joint that goes to and fro by less than this share of its speed limit is at rest."""
WATCHED = 1.0
"""The time in which the target rests is watched as a whole and in pieces of this length [s]."""
LEAST = 0.3
"""A shorter time in which the target rests is not watched [s]."""
UNDER_WAY = 0.75
"""An arm that comes farther than this share of the way that it goes is led somewhere."""
FULL = 0.5
"""An acceleration counts as full from this share of its limit on: a joint that chatters saturates, and noise
that shakes one so hard is found in the same way."""
NEAR_TICKS = 3
"""Full accelerations of opposite signs that lie no more than so many ticks apart are one jolt."""
JOLTS = 10
"""So many jolts in a row may be a correction that dies away; more are chatter. A joint that swings at its
limits turns after many ticks, and no deadbeat answer needs as many."""


def rest(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How fast joints swing although the target rests, as a share of their limit, (K, nv).

    All the time is watched from when the arm has had the time to come to rest, as a whole, for slow swings,
    and in overlapping pieces, for those that end. An arm on its way does not count, one that a scheme still
    leads to its posture, or a slow one whose target is far: a joint that turns on such a way does not swing.
    On it the joints come most of the way that they go, each measured by what it can go in a second.
    """
    result = np.zeros((len(run.status), len(arm.names)))
    moving = np.flatnonzero(np.abs(np.diff(run.target, axis=0)).max(axis=(1, 2), initial=0.0))
    first = (0 if not moving.size else int(moving[-1]) + 1) + round(strict.calm / run.dt)
    if (len(result) - first) * run.dt < LEAST:
        return result
    obeys, _ = health(arm, run)
    last, piece = len(result), round(WATCHED / run.dt)
    pieces = [(at, at + piece) for at in range(first, last - piece, max(1, piece // 2))]
    for begin, end in [(first, last), (max(first, last - piece), last), *pieces]:
        swings = _swings(arm, run, begin, end)
        worst = np.where(obeys[begin:end].all(axis=0), np.maximum(swings - STILL, 0.0), 0.0)
        result[end - 1] = np.maximum(result[end - 1], worst)
    return result


def _swings(arm: ModelFile, run: Trace, begin: int, end: int) -> FloatArray:
    """The slower one of the fastest ways up and down between two ticks, as a share of the limit, (nv,)."""
    q, over = run.q[begin : end + 1], max(1, round(SMOOTH / run.dt))
    by_speed = q / np.where(np.isfinite(arm.v_max), arm.v_max, 1.0)
    gone, come = np.abs(np.diff(by_speed, axis=0)).sum(), np.abs(by_speed[-1] - by_speed[0]).sum()
    if come > UNDER_WAY * gone:
        return np.zeros(q.shape[1])
    share = (q[over:] - q[:-over]) / (over * run.dt * arm.v_max)
    return np.asarray(np.minimum(share.max(axis=0), -share.min(axis=0)))


def chatter(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How many jolts in a row a joint gives beyond those of a correction, (K, nv).

    A jolt is a full acceleration that turns into a full one of the other sign within some ticks.
    """
    obeys, limits = health(arm, run)
    a = np.diff(run.v, axis=0) / run.dt
    counts = obeys & ~jumps(arm, run, strict)[:, None] & (np.abs(a) >= FULL * limits["a_max"])
    result = np.zeros(a.shape)
    for i in range(a.shape[1]):
        full = np.flatnonzero(counts[:, i])
        turned = np.diff(np.sign(a[full, i])) != 0.0
        turns = full[1:][turned & (np.diff(full) <= NEAR_TICKS)]
        row = 1
        for before, now in pairwise(turns):
            row = row + 1 if now - before <= NEAR_TICKS else 1
            result[now, i] = max(0.0, row - JOLTS)
    return result
