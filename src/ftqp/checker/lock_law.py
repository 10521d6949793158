"""The laws of joints that stand: locked ones, and an arm that was held as a whole."""

from typing import Any

import numpy as np

from ftqp.checker.joint_health import health
from ftqp.checker.model_file import ModelFile
from ftqp.checker.trace import Failure, Strictness, Trace
from ftqp.core.checks import BoolArray, FloatArray

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
        knows = stood & (t > failure.told + strict.grace)
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
