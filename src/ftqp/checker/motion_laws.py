"""The laws of joints: limits and room to brake, swings and chatter, locks and holds.

A joint may be beyond a limit only by what it was given: it began there, its limits were made smaller, or a
blow threw it. What it was given ends at full deceleration, and is not given again.
"""

from itertools import pairwise
from typing import Any

import numpy as np

from ftqp.checker.joint_health import health, jumps, reported_anew
from ftqp.checker.model_file import ModelFile
from ftqp.checker.trace import Failure, Strictness, Trace
from ftqp.core.checks import BoolArray, FloatArray

FULLY = 1e-6
"""Full braking may miss this share of the acceleration limit."""
BAND_SIGMAS = 6.0
"""Noise of the encoders counts as so many standard deviations."""


def speed(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """By how much joints are faster than their limit after each tick, as a share of it, (K, nv).

    A joint that is faster when its limits are made smaller, or is thrown, is brought back at full
    deceleration, v <= max(v_max, v0 - a_max (t - t0)), and may not become faster again on the way.
    """
    obeys, limits = health(arm, run)
    v_max, slower, v = limits["v_max"], limits["a_max"] * run.dt, np.abs(run.v)
    result = np.zeros(obeys.shape)
    if not (obeys & (v[1:] > (1.0 + strict.speed) * v_max)).any():
        return result
    fresh, blow = reported_anew(obeys, limits), jumps(arm, run, strict.blow)
    given = np.zeros(v.shape[1])
    for k in range(len(result)):
        given = np.where(fresh[k], np.maximum(given, v[k]), given)
        given = np.maximum(v_max[k], given - np.where(np.isfinite(slower[k]), slower[k], np.inf))
        if blow[k]:
            given = np.maximum(given, v[k + 1])
        over = np.where(np.isfinite(given), v[k + 1] / given - 1.0, 0.0)
        result[k] = np.where(obeys[k], over - strict.speed, 0.0)
        given = np.minimum(given, np.maximum(v_max[k], v[k + 1]))
    return result


def acceleration(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """By how much velocities change faster than the limit, as a share of it, (K, nv)."""
    obeys, limits = health(arm, run)
    over = np.abs(np.diff(run.v, axis=0)) / (run.dt * limits["a_max"]) - 1.0
    rounding = 4.0 * np.finfo(float).eps * np.abs(run.v[1:]) / (run.dt * limits["a_max"])
    return np.where(
        obeys & ~jumps(arm, run, strict.grace)[:, None], over - rounding - strict.acceleration, 0.0
    )


def position(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far joints go beyond their range in all [rad or m], (K, nv).

    One that is beyond when its limits are made smaller may not go farther beyond, and not again once it has
    come back. A joint that could not brake in time any more, for its limits have just shrunk, has to brake
    fully, also in the tick in which it comes to rest and turns.
    """
    obeys, limits = health(arm, run)
    now, then = (np.maximum(q - limits["q_max"], limits["q_min"] - q) for q in (run.q[:-1], run.q[1:]))
    if not (obeys & (then > strict.position)).any():
        return np.zeros(obeys.shape)
    late = missing_way(run.q[:-1], run.v[:-1], limits, run) > 0.0
    slower = np.sign(run.v[:-1]) * (run.v[:-1] - run.v[1:]) / run.dt
    excused = ~obeys | (late & (slower >= limits["a_max"] * (1.0 - FULLY)))
    return _beyond(now, then, reported_anew(obeys, limits), excused, strict.position)


def braking(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """What is missing of the way that a joint needs to brake before its end, (K, nv) [rad or m].

    What is missing when its limits are made smaller may go on missing, for it stays the same while the joint
    brakes fully. At the velocity level braking goes in whole ticks. An arm whose servos hear noise is shaken
    by it about the command that keeps the way.
    """
    obeys, limits = health(arm, run)
    now, then = (
        missing_way(q, v, limits, run) for q, v in ((run.q[:-1], run.v[:-1]), (run.q[1:], run.v[1:]))
    )
    let = strict.position + BAND_SIGMAS * strict.noise
    if not (obeys & (then > let)).any():
        return np.zeros(obeys.shape)
    excused = ~obeys | jumps(arm, run, strict.blow)[:, None]
    return _beyond(now, then, reported_anew(obeys, limits), excused, let)


def _beyond(now: FloatArray, then: FloatArray, fresh: Any, excused: Any, let: float) -> FloatArray:
    """By how much ``then`` exceeds what was given, where it is not excused, (K, nv)."""
    result = np.zeros(then.shape)
    given = np.zeros(then.shape[1])
    for k, after in enumerate(then):
        given = np.where(fresh[k], np.maximum(given, now[k]), given)
        given = np.where(excused[k], np.maximum(given, after), given)
        result[k] = np.where(excused[k], 0.0, after - given - let)
        given = np.minimum(given, np.maximum(after, 0.0))
    return result


def missing_way(q: FloatArray, v: FloatArray, limits: dict[str, FloatArray], run: Trace) -> FloatArray:
    """What is missing of the way that joints need to brake before the end that they go to, (K, nv)."""
    fast, a = np.abs(v), limits["a_max"]
    with np.errstate(invalid="ignore", divide="ignore"):
        way = np.where(np.isfinite(a), fast**2 / (2.0 * a), 0.0)
        if run.level == "velocity":
            steps = np.where(np.isfinite(a), np.floor(fast / (a * run.dt)), 0.0)
            way = np.where(
                np.isfinite(a), run.dt * (steps * fast - 0.5 * a * run.dt * steps * (steps + 1.0)), 0.0
            )
    room = np.where(v > 0.0, limits["q_max"] - q, q - limits["q_min"])
    return way - room


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
    """How many jolts, full acceleration one way and soon the other, beyond a correction, (K, nv)."""
    obeys, limits = health(arm, run)
    a = np.diff(run.v, axis=0) / run.dt
    counts = obeys & ~jumps(arm, run, strict.grace)[:, None] & (np.abs(a) >= FULL * limits["a_max"])
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


ROUNDING, OBSERVED = 1e-12, 1e-4
"""Of the end of a ramp, and of the speed with which it begins [rad/s or m/s]."""
SLOWEST = 0.25
"""A joint that locks brakes with at least this share of its acceleration limit, whatever else is said."""

LEAP = 0.1
"""A joint may be faster by this share after a hold than its limit, or than it was before."""
BLAMED = 1.0
"""What a joint that works and is said to have failed is broken by, or an arm that was stopped."""


def failed(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far a locked joint has moved since it stands, or was sent since it is known, (K, nv) [rad or m].

    It stands when it has come to rest, and at the latest when it has had the time for that. Ways that it is
    sent count together, whatever their direction. One whose brake slips moves as it likes.
    """
    result = np.zeros((len(run.status), len(arm.names)))
    t = run.t
    for failure in run.failures:
        if failure.kind != "locked":
            continue
        i, lasts = failure.joint, t < failure.until - 0.5 * run.dt
        stood = stands(arm, run, strict, failure) & lasts
        moved = np.zeros(len(t))
        if stood.any() and not failure.slips:
            moved = np.where(stood, np.abs(run.q[1:, i] - run.q[int(np.argmax(stood)), i]), 0.0)
        knows = stood & (t > failure.reported_at + strict.grace)
        sent = np.where(knows, np.abs(run.sent_v[:, i]) - _ramp(run, failure, t), 0.0)
        sent = np.where(knows, run.dt * np.cumsum(np.maximum(sent, 0.0)), 0.0)
        result[:, i] = np.maximum(result[:, i], np.maximum(moved, sent) - strict.creep)
    return result


def stands(arm: ModelFile, run: Trace, strict: Strictness, failure: Failure) -> BoolArray:
    """From which tick on a locked joint stands, (K,)."""
    t, i = run.t, failure.joint
    since = t >= failure.since + failure.closes
    came = np.cumsum(since & (np.abs(run.v[:-1, i]) <= strict.standing)) > 1
    if not since.any():
        return came
    first = int(np.argmax(since))
    brakes = min(failure.deceleration, SLOWEST * float(arm.a_max[i]))
    needs = abs(float(run.v[first, i])) / brakes if np.isfinite(brakes) else 0.0
    return np.asarray(came | (t > t[first] + needs + strict.grace + 2.0 * run.dt))


def _ramp(run: Trace, failure: Failure, t: Any) -> Any:
    """How fast a joint may still be sent to move while its command comes to rest, (K,) [rad/s or m/s].

    A planner that gets a late report brings its own command to rest as reported of the joint, from what
    it observed last, which need not be quite at rest.
    """
    if not np.isfinite(failure.deceleration) or not np.isfinite(failure.reported_at):
        return 0.0
    first = int(np.searchsorted(t, failure.reported_at - 0.5 * run.dt))
    if first == 0 or first >= len(t):
        return 0.0
    left = abs(run.sent_v[first - 1, failure.joint]) - failure.deceleration * (t - t[first - 1])
    observed = np.where(np.abs(t - t[first]) < 1.5 * run.dt, OBSERVED, ROUNDING)
    return np.where(t >= t[first], np.maximum(left, observed) + ROUNDING, 0.0)


def held(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """By what share joints that work leap after a hold of the whole arm, or 1 where they are blamed, (K, nv).

    Nobody has failed because all stand: none is said to have, and the arm is not stopped for it, unless a
    joint has really failed.
    """
    if not run.holds:
        return np.zeros((len(run.status), len(arm.names)))
    obeys, limits = health(arm, run)
    result = np.zeros(obeys.shape)
    t, v = run.t, np.abs(run.v[1:])
    stopped = np.array([status == "STOPPED" for status in run.status])
    failing = min((failure.since for failure in run.failures), default=np.inf)
    for begin, end in run.holds:
        before, after = t < begin - 0.5 * run.dt, t > end - 0.5 * run.dt
        most = np.maximum(limits["v_max"], v[before].max(axis=0, initial=0.0))
        over = np.where(after[:, None] & obeys, v / ((1.0 + LEAP) * most) - 1.0, 0.0)
        blamed = (t > begin - 0.5 * run.dt)[:, None] & obeys & run.blamed
        blamed |= ((t > begin - 0.5 * run.dt) & (t < failing) & stopped)[:, None]
        result = np.maximum(result, np.where(blamed, BLAMED, over))
    return result
