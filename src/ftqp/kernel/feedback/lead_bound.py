"""The lead has a bound: the reference never runs away from a joint that does not follow it.

What counts is how far the reference is ahead of the sample of its time;
behind position drives, how far the command would lead, beside what its servo explains.
Where that would exceed the bound the joint brakes, and what is sent goes no farther.
Source: docs/theory/feedback.md, "A whole arm that is held".
"""

from math import inf
from typing import Any

from ftqp.kernel.feedback.error_band import BAND_TIME, ERROR_BAND
from ftqp.kernel.feedback.samples import slot
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import ACCELERATION, POSITION_DRIVE, VIABILITY
from ftqp.kernel.layout.thresholds import GEAR, NOISE_LEVELS, UNLIMITED
from ftqp.kernel.maths.elementary import sqrt
from ftqp.kernel.monitor.leading import seen_now, wanted
from ftqp.kernel.monitor.servos import noise_of
from ftqp.kernel.rows.joint_intervals import braking, narrow, viability

REST_TIME = 0.01
"""The reference may be so far ahead of a joint at rest as that goes at its limit in this time [s], ..."""
LEAST = 1.1 * ERROR_BAND
"""... or so far [rad or m], so that a joint that stands leaves its error band and is seen to lag; what the
joint goes in ``BAND_TIME`` comes on top."""


@jit
def _room(K: Any, then: int, i: int) -> tuple[float, float]:
    """How far the reference is ahead of joint i, and how far it may be."""
    if K.monitor.on:
        return wanted(K, i) - seen_now(K, i), K.monitor.room[i]
    top = min(K.limits.v_max[i], UNLIMITED)
    most = max(REST_TIME * top, LEAST) + BAND_TIME * abs(K.state.v[i])
    most += NOISE_LEVELS * max(K.feedback.sigma, K.held.sigma[i])
    return K.past.q[then, i] - K.feedback.seen[i], most


@jit
def _may_brake(K: Any, i: int, room: float, v: float, own: float) -> bool:
    """Whether joint i is about to be farther behind its reference than it may, by their speeds."""
    away = v - own
    return away > 0.0 and away * away > 2.0 * K.limits.a_brake[i] * (room - 1.5 * K.state.dt * away)


@jit
def _end(K: Any, then: int, i: int) -> tuple[float, float]:
    """To which side the bound ends the interval of joint i, and by what acceleration or velocity; 0 if not.

    A reference that rests there goes on where the joint has moved by more than noise does and gears play: an
    end that opened with each bit of noise would let the planner count on the joint every other tick.
    """
    state, limits, dt, v = K.state, K.limits, K.state.dt, K.state.v[i]
    ahead, most = _room(K, then, i)
    way = 1.0 if ahead > 0.0 else -1.0
    rests = K.monitor.on and way * v <= 0.0
    if rests and most - abs(ahead) <= GEAR + 4.0 * sqrt(noise_of(K, i) / K.monitor.every):
        return way, -way * v / dt if state.level == ACCELERATION else 0.0
    way = 1.0 if v > 0.0 else -1.0
    room, v, own = most - way * ahead, abs(v), way * K.feedback.v_hat[i]
    if not _may_brake(K, i, room, v, own):
        return 0.0, 0.0
    a_max, a_brake = limits.a_max[i], limits.a_brake[i]
    if state.level == ACCELERATION:
        return way, max(viability(v - own, room, inf, a_max, a_brake, dt)[0], -v / dt)
    return way, max(braking(v - own, room, inf, a_max, a_brake, dt)[0] + own, 0.0)


@part_jit
def keep_near(K: Any) -> None:
    """The end of a joint's interval where its lead would exceed the bound, which goes with the joint.

    The law is that of the ends of ranges, for the speed and the way beside those of the joint; it brakes a
    reference that runs away, and never turns it back. Behind position drives the bound is that of the
    command's lead, and every joint keeps to it, so that the others take over from one that does not follow.
    Of other arms one joint that stays behind alone has failed, and is looked at; two are an arm that is held.
    """
    feedback, faults = K.feedback, K.faults
    if K.monitor.on and (not K.monitor.sees or feedback.kind != POSITION_DRIVE):
        return
    if not feedback.active or feedback.exact or K.held.on or K.limits.conversion != VIABILITY:
        return
    then, ways, ends, behind = slot(feedback, feedback.latency), K.scratch.joints, K.scratch.impulse, 0
    for k in range(faults.working):
        i = faults.order[k]
        ways[i], ends[i] = _end(K, then, i) if K.chain.lead[i] == i else (0.0, 0.0)
        behind += 1 if ways[i] != 0.0 else 0
    if behind < (1 if K.monitor.on else min(2, faults.working)):
        return
    for k in range(faults.working):
        i = faults.order[k]
        if ways[i] > 0.0:
            narrow(K.qp, i, -inf, ends[i])
        elif ways[i] < 0.0:
            narrow(K.qp, i, -ends[i], inf)
