"""The lead of a position arm has a bound: the reference never runs away from a joint that does not follow it.

What counts is how far the command would lead, beside what the joint's servo explains. Where that would exceed
the bound the joint brakes, and what is sent goes no farther. Of other arms the loop is bounded, and not its
reference: a torque arm's seeks no speed that the reference may not have.
Source: docs/theory/feedback.md, "A whole arm that is held".
"""

from math import inf
from typing import Any

from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import ACCELERATION, POSITION_DRIVE, VIABILITY
from ftqp.kernel.layout.thresholds import GEAR
from ftqp.kernel.maths.elementary import sqrt
from ftqp.kernel.monitor.leading import seen_now, wanted
from ftqp.kernel.monitor.servos import noise_of
from ftqp.kernel.rows.joint_intervals import braking, narrow, viability


@jit
def _end(K: Any, i: int) -> tuple[float, float]:
    """To which side the bound ends the interval of joint i, and by what acceleration or velocity; 0 if not.

    A reference that rests there goes on where the joint has moved by more than noise does and gears play: an
    end that opened with each bit of noise would let the planner count on the joint every other tick.
    """
    state, limits, dt, v = K.state, K.limits, K.state.dt, K.state.v[i]
    ahead, most = wanted(K, i) - seen_now(K, i), K.monitor.room[i]
    way = 1.0 if ahead > 0.0 else -1.0
    if way * v <= 0.0 and most - abs(ahead) <= GEAR + 4.0 * sqrt(noise_of(K, i) / K.monitor.every):
        return way, -way * v / dt if state.level == ACCELERATION else 0.0
    way = 1.0 if v > 0.0 else -1.0
    room, v, own = most - way * ahead, abs(v), way * K.feedback.v_hat[i]
    a_max, a_brake, away = limits.a_max[i], limits.a_brake[i], v - own
    if away <= 0.0 or away * away <= 2.0 * a_brake * (room - 1.5 * dt * away):
        return 0.0, 0.0
    if state.level == ACCELERATION:
        return way, max(viability(away, room, inf, a_max, a_brake, dt)[0], -v / dt)
    return way, max(braking(away, room, inf, a_max, a_brake, dt)[0] + own, 0.0)


@part_jit
def keep_near(K: Any) -> None:
    """The end of a joint's interval where its lead would exceed the bound, which goes with the joint.

    The law is that of the ends of ranges, for the speed and the way beside those of the joint; it brakes a
    reference that runs away, and never turns it back. Every joint keeps to it, so that the others take over
    from one that does not follow.
    """
    feedback, faults = K.feedback, K.faults
    if not K.monitor.sees or feedback.kind != POSITION_DRIVE:
        return
    if not feedback.active or feedback.exact or K.held.on or K.limits.conversion != VIABILITY:
        return
    for k in range(faults.working):
        i = faults.order[k]
        way, end = _end(K, i) if K.chain.lead[i] == i else (0.0, 0.0)
        if way > 0.0:
            narrow(K.qp, i, -inf, end)
        elif way < 0.0:
            narrow(K.qp, i, -end, inf)
