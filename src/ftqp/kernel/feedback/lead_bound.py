"""The lead has a bound: the reference never runs away from a joint that does not follow it.

What counts is how far the reference is ahead of the sample of its time, beside how far off it usually is;
behind position drives, how far the command would lead, beside what its servo explains.
Where that would exceed the bound the joint brakes, and what is sent goes no farther.
Source: docs/theory/feedback.md, "A whole arm that is held".
"""

from math import inf
from typing import Any

from ftqp.kernel.feedback.error_band import BAND_SIGMAS, BAND_TIME, ERROR_BAND
from ftqp.kernel.feedback.samples import slot
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import ACCELERATION, POSITION_DRIVE, TORQUE_DRIVE, VIABILITY
from ftqp.kernel.layout.thresholds import UNLIMITED
from ftqp.kernel.monitor.leading import seen_now, wanted
from ftqp.kernel.rows.joint_intervals import braking, narrow, viability

REST_TIME = 0.01
"""The reference may be so far ahead of a joint at rest as that goes at its limit in this time [s], ..."""
LEAST = 1.1 * ERROR_BAND
"""... or so far [rad or m], so that a joint that stands leaves its error band and is seen to lag; what the
joint goes in ``BAND_TIME`` comes on top, ..."""
LAGS = 2.0
"""... but no farther than a servo of a known bandwidth w lags at the joint's limit without velocities, 2
v_max/w."""


@jit
def beyond(K: Any, then: int, i: int, v: float) -> float:
    """How much farther than the bound the reference is ahead of joint i, < 0 where it is not; towards v."""
    if K.monitor.on:
        ahead = wanted(K, i) - seen_now(K, i)
        return (ahead if v > 0.0 else -ahead) - K.monitor.room[i]
    off = K.past.q[then, i] - K.feedback.seen[i]
    top = min(K.limits.v_max[i], UNLIMITED)
    most = max(REST_TIME * top, LEAST) + BAND_TIME * abs(v)
    if K.feedback.servo < inf:
        most = min(most, max(LAGS * top / K.feedback.servo, LEAST))
    most += BAND_SIGMAS * max(K.feedback.sigma, K.held.sigma[i])
    if K.feedback.kind != TORQUE_DRIVE:
        most += abs(K.held.baseline[i])
    return (off if v > 0.0 else -off) - most


@jit
def _may_brake(K: Any, then: int, i: int) -> bool:
    """Whether joint i is about to be farther behind its reference than it may, by their speeds."""
    v, dt = K.state.v[i], K.state.dt
    away, room = abs(v) - (1.0 if v > 0.0 else -1.0) * K.feedback.v_hat[i], -beyond(K, then, i, v)
    far = away * away <= 2.0 * K.limits.a_brake[i] * (room - 1.5 * dt * away)
    return away > 0.0 and K.chain.lead[i] == i and not far


@part_jit
def keep_near(K: Any) -> None:
    """The end of a joint's interval where its lead would exceed the bound, which goes with the joint.

    The law is that of the ends of ranges, for the speed and the way beside those of the joint; it brakes a
    reference that runs away, and never turns it back. Behind position drives the bound is that of the
    command's lead, and every joint keeps to it, so that the others take over from one that does not follow.
    Of other arms one joint that stays behind alone has failed, and is looked at; two are an arm that is held.
    """
    state, feedback, limits, faults = K.state, K.feedback, K.limits, K.faults
    if K.monitor.on and (not K.monitor.sees or feedback.kind != POSITION_DRIVE):
        return
    if not feedback.active or feedback.exact or K.held.on or limits.conversion != VIABILITY:
        return
    then, dt, behind = slot(feedback, feedback.latency), state.dt, 0
    for k in range(faults.working):
        behind += 1 if _may_brake(K, then, faults.order[k]) else 0
    if behind < (1 if K.monitor.on else min(2, faults.working)):
        return
    for k in range(faults.working):
        i = faults.order[k]
        if not _may_brake(K, then, i):
            continue
        v = state.v[i]
        sign = 1.0 if v > 0.0 else -1.0
        own, room = sign * feedback.v_hat[i], -beyond(K, then, i, v)
        away, a_max, a_brake = sign * v - own, limits.a_max[i], limits.a_brake[i]
        if state.level == ACCELERATION:
            most = max(viability(away, room, inf, a_max, a_brake, dt)[0], -sign * v / dt)
        else:
            most = max(braking(away, room, inf, a_max, a_brake, dt)[0] + own, 0.0)
        narrow(K.qp, i, -inf if v > 0.0 else -most, most if v > 0.0 else inf)
