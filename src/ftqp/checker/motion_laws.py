"""The laws of motion: speed, acceleration, range and room to brake, each held against the limit itself.

A joint may be beyond a limit only by what it was given: it began there, its limits were made smaller, or a
blow threw it. What it was given ends at full deceleration, and is not given again.
"""

from typing import Any

import numpy as np

from ftqp.checker.joint_health import health, jumps, thrown, told_anew
from ftqp.checker.model_file import ModelFile
from ftqp.checker.trace import Strictness, Trace
from ftqp.core.checks import FloatArray

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
    fresh, blow = told_anew(obeys, limits), thrown(arm, run, strict)
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
    return np.where(obeys & ~jumps(arm, run, strict)[:, None], over - rounding - strict.acceleration, 0.0)


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
    return _beyond(now, then, told_anew(obeys, limits), excused, strict.position)


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
    excused = ~obeys | thrown(arm, run, strict)[:, None]
    return _beyond(now, then, told_anew(obeys, limits), excused, let)


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
