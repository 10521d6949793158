"""The laws that a run is held against, each from the truth and the model file alone."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.checker.cone_law import cone
from ftqp.checker.model_file import ModelFile
from ftqp.checker.strictness import Strictness
from ftqp.checker.task_law import tasks
from ftqp.checker.trace import Failure, Trace
from ftqp.core.checks import BoolArray, FloatArray

ROWS = ("x", "y", "z", "rx", "ry", "rz")
SMOOTH = 0.02
"""What shakes a joint by less than this long is noise and goes nowhere [s]."""
STILL = 0.01
"""A joint that goes to and fro by less than this share of its speed limit is at rest."""
WATCHED = 1.0
"""How long at most the end of a run is watched in which the target rests [s], and how long at least."""
LEAST = 0.3
UNDER_WAY = 0.75
"""An arm that comes farther than this share of the way that it goes is led somewhere."""
FULLY = 1e-6
"""Full braking may miss this share of the acceleration limit."""
HALF_TURN = 1e-3
"""Rotations so near to half a turn are left to pinocchio [1 + cosine of the angle]."""
TELLING = 1e-9
"""News that come between two ticks are heard at the later one, to this [s]."""
ROUNDING, OBSERVED = 1e-12, 1e-4
"""Of the end of a ramp, and of the speed with which it begins [rad/s or m/s]."""
IMPACT = 0.1
"""A joint that meets its end stop more slowly than this does not shake the others [rad/s or m/s]."""
ERROR_BAND, BAND_TIME, BAND_SIGMAS = 0.02, 0.1, 6.0
"""A joint follows its command while it is as near as 0.02 rad or m, six sigma and what it moves in 0.1 s."""


def health(arm: ModelFile, run: Trace) -> tuple[BoolArray, dict[str, FloatArray]]:
    """Which joints obey, (K, nv), and the limits that are left, (K, nv) by name, at each tick.

    A weakened joint has its lower limits from when the planner is told; until then nobody knows that it does
    not do what it is told.

    Args:
        arm: The arm.
        run: The run.
    """
    t = run.dt * np.arange(len(run.status))
    obeys = np.ones((len(t), len(arm.names)), dtype=np.bool_)
    limits = {
        name: np.tile(getattr(arm, name), (len(t), 1))
        for name in ("q_min", "q_max", "v_max", "a_max", "tau_max")
    }
    for failure in run.failures:
        fails = (t >= failure.since - 0.5 * run.dt) & (t < failure.until - 0.5 * run.dt)
        if failure.kind == "degraded":
            knows = fails & (t >= failure.told - TELLING)
            for name, share in failure.shares.items():
                limits[name][knows, failure.joint] *= share
            fails &= ~knows & (failure.told > failure.since)
        obeys[fails, failure.joint] = False
    return obeys, limits


def jumps(arm: ModelFile, run: Trace, strict: Strictness) -> BoolArray:
    """Ticks in which a joint stops in no time, so that velocities of the others jump, (K,).

    One that locks so does, and one that swings freely into its end stop: outside its range it loses more than
    half of its speed in a tick. What that does to the others is mechanics, and no command's doing; in physics
    they swing for a while.

    Args:
        arm: The arm.
        run: The run.
        strict: What is let pass.
    """
    t = run.dt * np.arange(len(run.status))
    result = np.zeros(len(t), dtype=np.bool_)
    for failure in run.failures:
        if failure.jumps:
            for moment in (failure.since, failure.told):
                result |= np.abs(t - moment) < 1.5 * run.dt
        if failure.kind == "free":
            i = failure.joint
            q, v = run.q[:, i], run.v[:, i]
            outside = (q < arm.q_min[i]) | (q > arm.q_max[i])
            lost = (np.abs(v[:-1]) > IMPACT) & (v[1:] * np.sign(v[:-1]) < 0.5 * np.abs(v[:-1]))
            struck = (outside[:-1] | outside[1:]) & lost & (t >= failure.since)
            after = max(1, round(strict.grace / run.dt))
            result |= np.convolve(struck, np.ones(after + 1))[: len(t)] > 0.0
    return result


def speed(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """By how much joints are faster than their limit after each tick, as a share of it, (K, nv).

    A limit that has just shrunk is reached at full deceleration.
    """
    obeys, limits = health(arm, run)
    before, after = np.abs(run.v[:-1]), np.abs(run.v[1:])
    allowed = np.maximum(limits["v_max"], before - limits["a_max"] * run.dt)
    over = np.where(np.isfinite(allowed), after / allowed - 1.0, 0.0)
    return np.where(obeys & ~jumps(arm, run, strict)[:, None], over - strict.speed, 0.0)


def acceleration(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """By how much velocities change faster than the limit, as a share of it, (K, nv)."""
    obeys, limits = health(arm, run)
    over = np.abs(np.diff(run.v, axis=0)) / (run.dt * limits["a_max"]) - 1.0
    rounding = 4.0 * np.finfo(float).eps * np.abs(run.v[1:]) / (run.dt * limits["a_max"])
    return np.where(obeys & ~jumps(arm, run, strict)[:, None], over - rounding - strict.acceleration, 0.0)


def position(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far joints go beyond their range, or farther beyond than they were [rad or m], (K, nv).

    A joint that could not brake in time any more, for its limits have just shrunk, has to brake fully, also
    in the tick in which it comes to rest and turns.
    """
    obeys, limits = health(arm, run)
    out = [np.maximum(q - limits["q_max"], limits["q_min"] - q) for q in (run.q[:-1], run.q[1:])]
    late = _missing(run.q[:-1], run.v[:-1], limits, run) > 0.0
    slower = np.sign(run.v[:-1]) * (run.v[:-1] - run.v[1:]) / run.dt
    excused = late & (slower >= limits["a_max"] * (1.0 - FULLY))
    over = out[1] - np.maximum(out[0], 0.0) - strict.position
    return np.where(obeys & ~excused, over, 0.0)


def braking(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """What is missing of the way that a joint needs to brake before its end, (K, nv) [rad or m].

    Joints that could not brake in time before the tick do not count. At the velocity level braking goes in
    whole ticks. An arm whose servos hear noise is shaken by it about the command that keeps the way.
    """
    obeys, limits = health(arm, run)
    missing = [_missing(q, v, limits, run) for q, v in ((run.q[:-1], run.v[:-1]), (run.q[1:], run.v[1:]))]
    return np.where(
        obeys & (missing[0] <= 0.0) & ~jumps(arm, run, strict)[:, None],
        missing[1] - strict.position - BAND_SIGMAS * strict.noise,
        0.0,
    )


def _missing(q: FloatArray, v: FloatArray, limits: dict[str, FloatArray], run: Trace) -> FloatArray:
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


def plane(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far points are beyond their planes after each tick, by the joint that they move with, (K, nv) [m].

    One that begins beyond its plane may not go farther beyond it, and none again once it has come back. No
    motor keeps a point that a freely swinging joint moves; where it is in the end counts as its beginning.
    """
    result = np.zeros((len(run.status), len(arm.names)))
    t = run.dt * np.arange(len(run.status))
    for one in run.planes:
        beyond = one.offset - arm.point(run.q, one.joint, one.at_zero) @ np.array(one.normal)
        excused = np.zeros(len(t), dtype=np.bool_)
        for failure in run.failures:
            if failure.kind == "free" and failure.joint in arm.moves_with(one.joint):
                excused |= (t > failure.since - 1.5 * run.dt) & (t < failure.until + 0.5 * run.dt)
        allowed = max(float(beyond[0]), 0.0)
        for k, now in enumerate(beyond[1:]):
            allowed = max(float(now), 0.0) if excused[k] else allowed
            result[k, one.joint] = max(result[k, one.joint], now - allowed - strict.plane)
            allowed = min(allowed, max(float(now), 0.0))
    return result


def torque(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """By how much joints carry more than their limit while OK is claimed, as a share of it, (K, nv)."""
    if not arm.has_masses:
        return np.zeros((len(run.status), len(arm.names)))
    obeys, limits = health(arm, run)
    tau = arm.torques(run.q[:-1], run.v[:-1], np.diff(run.v, axis=0) / run.dt)
    claimed = np.array([status == "OK" for status in run.status])
    over = np.abs(tau) / limits["tau_max"] - 1.0
    return np.where(obeys & claimed[:, None] & ~jumps(arm, run, strict)[:, None], over - strict.torque, 0.0)


def failed(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far a locked joint moves once it stands, or is sent to move after the planner was told, (K, nv)."""
    result = np.zeros((len(run.status), len(arm.names)))
    t = run.dt * np.arange(len(run.status))
    for failure in run.failures:
        if failure.kind != "locked":
            continue
        i = failure.joint
        stood = np.cumsum((t >= failure.since) & (np.abs(run.v[:-1, i]) <= strict.standing)) > 1
        stood &= t < failure.until - 0.5 * run.dt
        moved = np.where(stood, np.abs(np.diff(run.q[:, i])), 0.0)
        knows = stood & (t > failure.told + strict.grace)
        sent = np.where(knows, run.dt * (np.abs(run.sent_v[:, i]) - _ramp(run, failure, t)), 0.0)
        result[:, i] = np.maximum(result[:, i], np.maximum(moved, sent) - strict.creep)
    return result


def _ramp(run: Trace, failure: Failure, t: Any) -> Any:
    """How fast a joint may still be sent to move while its command comes to rest, (K,) [rad/s or m/s].

    A planner that was told late brings its own command to rest as it was told that the joint does, from what
    it observed last, which need not be quite at rest.
    """
    if not np.isfinite(failure.deceleration) or not np.isfinite(failure.told):
        return 0.0
    first = int(np.searchsorted(t, failure.told - 0.5 * run.dt))
    if first == 0 or first >= len(t):
        return 0.0
    left = abs(run.sent_v[first - 1, failure.joint]) - failure.deceleration * (t - t[first - 1])
    observed = np.where(np.abs(t - t[first]) < 1.5 * run.dt, OBSERVED, ROUNDING)
    return np.where(t >= t[first], np.maximum(left, observed) + ROUNDING, 0.0)


def honesty(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far the tip is beyond the tolerance, as a share of it, while OK is claimed too long, (K, 1)."""
    position_error, rotation_error = errors(arm, run)
    share = np.maximum(position_error / run.tolerance[0], rotation_error / run.tolerance[1])
    claimed = np.array([status == "OK" for status in run.status])
    return _lasting(np.where(claimed, share - 1.0, 0.0)[:, None], strict.grace, run.dt)


def tracking(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far the tip is beyond the tolerance although it can follow, as a share of the tolerance, (K, 1)."""
    position_error, rotation_error = errors(arm, run)
    share = np.maximum(position_error / run.tolerance[0], rotation_error / run.tolerance[1]) - 1.0
    known = run.can_be_followed & (run.dt * np.arange(len(share)) < run.until - 0.5 * run.dt)
    return _lasting(np.where(known, share, 0.0)[:, None], strict.grace, run.dt)


def inside(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far a joint that obeys is outside its range while OK is claimed, (K, nv) [rad or m]."""
    obeys, limits = health(arm, run)
    q = run.q[:-1]
    out = np.maximum(q - limits["q_max"], limits["q_min"] - q) - strict.position
    claimed = np.array([status == "OK" for status in run.status])[:, None]
    return _lasting(np.where(obeys & claimed, out, 0.0), strict.grace, run.dt)


def obedience(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How far a joint is outside its error band, while OK is claimed too long, (K, nv)."""
    band = ERROR_BAND + BAND_SIGMAS * strict.noise + BAND_TIME * np.abs(run.sent_v)
    away = np.abs(run.q[1:] - run.sent_q) - band
    claimed = np.array([status == "OK" for status in run.status])[:, None]
    known = np.zeros_like(away, dtype=np.bool_)
    t = run.dt * np.arange(len(run.status))
    for failure in run.failures:
        known[t >= failure.told, failure.joint] = True
    return _lasting(np.where(claimed & ~known, away, 0.0), max(strict.grace, 0.05), run.dt)


def rest(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """How fast joints swing at the end although the target rests, as a share of their limit, (K, nv).

    An arm on its way does not count, one that a scheme still leads to its posture, or a slow one whose target
    is far: a joint that turns on such a way does not swing. On it the joints come most of the way that they
    go, each measured by what it can go in a second.
    """
    result = np.zeros((len(run.status), len(arm.names)))
    moving = np.flatnonzero(np.abs(np.diff(run.target, axis=0)).max(axis=(1, 2), initial=0.0))
    calm = (0 if not moving.size else int(moving[-1]) + 1) + round(strict.calm / run.dt)
    first = max(calm, len(result) - round(WATCHED / run.dt))
    over = max(1, round(SMOOTH / run.dt))
    if (len(result) - first) * run.dt < LEAST:
        return result
    obeys, _ = health(arm, run)
    q = run.q[first:]
    by_speed = q / np.where(np.isfinite(arm.v_max), arm.v_max, 1.0)
    gone, come = np.abs(np.diff(by_speed, axis=0)).sum(), np.abs(by_speed[-1] - by_speed[0]).sum()
    if come > UNDER_WAY * gone:
        return result
    share = (q[over:] - q[:-over]) / (over * run.dt * arm.v_max)
    swings = np.minimum(share.max(axis=0), -share.min(axis=0))
    result[-1] = np.where(obeys[first:].all(axis=0), np.maximum(swings - STILL, 0.0), 0.0)
    return result


def finite(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """Infinite where a position or velocity, true or sent, is not finite, (K, nv)."""
    good = np.isfinite(run.sent_q) & np.isfinite(run.sent_v) & np.isfinite(run.q[1:]) & np.isfinite(run.v[1:])
    return np.where(good, 0.0, np.inf)


@lru_cache(maxsize=1)
def errors(arm: ModelFile, run: Trace) -> tuple[FloatArray, FloatArray]:
    """Distance [m] and angle [rad] from the true tip to its target along the rows of the task, each (K,).

    Several laws ask for those of one run, so the last ones are kept.

    Args:
        arm: The arm.
        run: The run.
    """
    tip, target = arm.tips(run.q[:-1]), run.target
    wanted = [row in run.rows for row in ROWS]
    distance = (target[:, :3, 3] - tip[:, :3, 3])[:, wanted[:3]]
    if run.axis is not None:
        away, wished = tip[:, :3, :3] @ run.axis, target[:, :3, :3] @ run.axis
        across = np.linalg.norm(np.cross(away, wished), axis=1)
        return np.linalg.norm(distance, axis=1), np.arctan2(across, np.sum(away * wished, axis=1))
    if not any(wanted[3:]):
        return np.linalg.norm(distance, axis=1), np.zeros(len(tip))
    turns = rotation_vectors(target[:, :3, :3] @ tip[:, :3, :3].transpose(0, 2, 1))
    return np.linalg.norm(distance, axis=1), np.linalg.norm(turns[:, wanted[3:]], axis=1)


def rotation_vectors(R: FloatArray) -> FloatArray:
    """The rotation vectors log(R) of rotations, (K, 3) [rad]; of (K, 3, 3).

    log(R) = t w / |w| with w = (R32 - R23, R13 - R31, R21 - R12) / 2 and t = atan2(|w|, (tr R - 1) / 2).

    Args:
        R: Rotations.
    """
    w = 0.5 * np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1)
    sine, cosine = np.linalg.norm(w, axis=1), 0.5 * (np.trace(R, axis1=1, axis2=2) - 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(sine > 0.0, np.arctan2(sine, cosine) / sine, 1.0)
    result: FloatArray = share[:, None] * w
    for k in np.flatnonzero(cosine < HALF_TURN - 1.0):
        result[k] = pin.log3(R[k])
    return result


def _lasting(values: FloatArray, time: float, dt: float) -> FloatArray:
    """Where ``values`` are positive for longer than ``time`` [s]; 0 elsewhere."""
    result = np.zeros_like(values)
    long = round(time / dt)
    if not (values > 0.0).any():
        return result
    for i in range(values.shape[1]):
        since = 0
        for k, value in enumerate(values[:, i] > 0.0):
            since = since + 1 if value else 0
            if since > long:
                result[k, i] = values[k, i]
    return result


Law = Callable[[ModelFile, Trace, Strictness], Any]
LAWS: dict[str, tuple[Law, str]] = {
    "finite": (finite, "what was sent or done is not a number"),
    "speed": (speed, "faster than its limit, by this share"),
    "acceleration": (acceleration, "accelerated more than its limit, by this share"),
    "position": (position, "beyond the end of its range, by this [rad or m]"),
    "braking": (braking, "cannot brake any more before the end of its range, by this [rad or m]"),
    "plane": (plane, "a point that it moves is beyond its plane, by this [m]"),
    "cone": (cone, "an axis that it moves is outside its cone, by this [rad]"),
    "torque": (torque, "carries more than its limit under the status OK, by this share"),
    "failed": (failed, "is locked and moves, or is sent to move, by this in a tick [rad or m]"),
    "honesty": (honesty, "OK was claimed although the tip is farther than the tolerance, by this share"),
    "tasks": (
        tasks,
        "OK was claimed although a task on level 0 is farther than the tolerance, by this share",
    ),
    "tracking": (tracking, "the target can be followed and was not, by this share of the tolerance"),
    "inside": (inside, "OK was claimed although a joint is outside its range, by this [rad or m]"),
    "obedience": (obedience, "OK was claimed although a joint is not where it was sent, by this [rad or m]"),
    "rest": (rest, "the target rests and the joint swings, at this share of its speed limit"),
}
"""Laws by name: how much each is broken by, at which tick and joint, and what to say of it."""
