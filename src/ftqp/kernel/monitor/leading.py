"""What is sent to a servo so that the arm follows as if the servo did so at once, and how far it may lead.

    u = q_r + x,    x = c v_r + m a_r + b + s g

What is uncertain counts by less, x^3/(x^2 + var x), next to what was stated. It counts as a whole: what its
parts cannot be told apart by cancels in the sum, and would not if each counted by itself. The command never
goes farther ahead of a joint than (c + dt) (|v| + v_max/4) + m a_max + sd(u) + f + 4 sigma: what lag
explains, and what is caught up with within the speed limit. That holds the command back; it never draws it
after a joint that falls away, for a servo that gives way lets it fall, and hides the fault.
Source: docs/theory/monitor.md, "What is sent".
"""

from math import inf
from typing import Any

from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import (
    ACCELERATION,
    IS_LOCKED,
    POSITION_DRIVE,
    STOPPED,
    VELOCITY_DRIVE,
    VIABILITY,
)
from ftqp.kernel.layout.feedback_rooms import SERVO
from ftqp.kernel.layout.thresholds import AT_REST, LONGEST, MOST_SHIFT, RETURNS, UNLIMITED
from ftqp.kernel.maths.elementary import is_finite, mul_add, sqrt, vector_view
from ftqp.kernel.maths.side_by_side import WIDTH, load_lanes, store_lanes
from ftqp.kernel.monitor.servos import DROOP, block_time, may_stick, noise_of, variance
from ftqp.kernel.rows.joint_intervals import narrow

BLENDS = 4.0
"""What is believed comes into the command over so many looks: nothing that is believed switches."""
SHOWS, SHOWS_MOST = 0.004, 0.02
"""A command may always lead by what the joint goes at its limit in this time [s]: one that led by less would
hide a fault, as what is learned of the droop would follow it. Nor by less than what the
evidence counts, up to the second time."""
CATCHES_UP = 0.25
"""Beside its speed a joint catches up with this share of its limit, what is believed comes in so fast, and so
are late targets made up for."""
ALL = 0.99
"""A joint that leads by this share of its bound leads by all of it."""
TURNS = 0.5
"""Servos that take velocities push a joint that is held by its excess in so long [s], and back."""


@jit
def certain(x: float, var: float) -> float:
    """x^3/(x^2 + var): x as far as it is known."""
    return x * x * x / (x * x + max(var, 0.0) + 1e-14)


@jit
def aim(K: Any, i: int) -> None:
    """How far joint i is to be led from now on, by what is known of it, and how far it may be."""
    M, theta, P = K.monitor, K.monitor.theta[i], K.monitor.P[i]
    phi, g = M.phi, M.weight[i]
    phi[0], phi[1], phi[2] = K.state.v_command[i], K.state.a_command[i], 0.0
    phi[3], phi[4], phi[5] = 1.0, g, 0.0
    M.unsure[i] = variance(P, phi)
    M.response[i] = max(sqrt(max(theta[1], 0.0) + sqrt(P[1, 1])), theta[0] + sqrt(P[0, 0]))
    M.droop[i] = certain(M.used[i, 3] + M.used[i, 4] * g, P[3, 3] + 2.0 * g * P[3, 4] + g * g * P[4, 4])
    top = min(K.limits.v_max[i], UNLIMITED)
    speed = min(top, max(abs(K.state.v_command[i]), M.peak_v[i]) + CATCHES_UP * top)
    phi[0], phi[1], phi[2], phi[3], phi[4], phi[5] = speed, 0.0, 1.0, 1.0, g, 0.0
    room = (max(theta[0], 0.0) + K.state.dt) * speed + max(theta[1], 0.0) * K.limits.a_max[i]
    room += sqrt(variance(P, phi)) + max(theta[2], 0.0) + 4.0 * sqrt(noise_of(K, i) / M.every)
    room = max(room, SHOWS * top, min(MOST_SHIFT * sqrt(M.S_sharp[i]), SHOWS_MOST * top))
    M.room[i] = room


@part_jit
def speed_up_gently(K: Any) -> None:
    """No joint speeds up by more than its servo takes up before the speed limit: a <= w_n (v_max - v).

    A servo answers the end of an acceleration a with an overshoot of a/(e w_n), and a lead of c v_r goes at
    v + c a meanwhile. w_n is the least that is likely, of m and of c alike: an arm of which nothing is known
    is led as carefully as one whose servos are slow. How a joint brakes is not touched, but that one which is
    seen to go unevenly keeps below the limit in between, too.
    """
    state, M, limits = K.state, K.monitor, K.limits
    if not M.sees or limits.conversion != VIABILITY:
        return
    for k in range(K.faults.working):
        i = K.faults.order[k]
        v, slow = state.v[i], max(M.response[i], state.dt)
        left = min(1.0 - K.feedback.speed_margin, 1.0 / (1.0 + M.ripple[i])) * limits.v_max[i] - abs(v)
        if left >= limits.a_max[i] * slow:
            continue
        a = left / slow if left > 0.0 or M.ripple[i] > 0.0 else 0.0
        if state.level == ACCELERATION:
            low, high = -a, a
        else:
            low, high = v - a * state.dt, v + a * state.dt
        narrow(K.qp, i, low if v <= 0.0 else -inf, high if v >= 0.0 else inf)


@jit
def seen_now(K: Any, i: int) -> float:
    """Where the command of joint i would be if it led by nothing: its place now, and its droop."""
    M = K.monitor
    now: float = M.means[0, i] + M.v[i] * block_time(K) + M.droop[i]
    return now


@jit
def blend(K: Any) -> None:
    """What is believed comes into the command slowly."""
    M = K.monitor
    share, size = min(1.0, 1.0 / (BLENDS * M.every)), K.chain.n * SERVO
    used, known = vector_view(M.used), vector_view(M.theta)
    for at in range(0, size, WIDTH):
        before = load_lanes(used, at)
        store_lanes(used, at, mul_add(share, load_lanes(known, at) - before, before))
    for i in range(K.chain.n):
        M.used[i, DROOP] += share * M.hold[i]


@jit
def way_of(K: Any, i: int) -> float:
    """How far what is sent to joint i may go in this tick: as fast as the joint may be, and not at once."""
    top, v = K.limits.v_max[i] / (1.0 + K.monitor.ripple[i]), max(abs(K.state.v_command[i]), abs(K.gate.v[i]))
    top = min(top, UNLIMITED)
    if K.cascade.outcome == STOPPED and not K.held.on:  # it stands
        return float(K.state.dt * max(AT_REST * top, v))
    ahead = min(max(K.monitor.used[i, 0], K.monitor.stated_lead[i]), LONGEST) if K.monitor.sees else LONGEST
    return float(K.state.dt * max(min(v + CATCHES_UP * top + ahead * abs(K.state.a_command[i]), top), v))


@jit
def wanted(K: Any, i: int) -> float:
    """u = q_r + x of joint i, which its lead may be too far for."""
    M, state = K.monitor, K.state
    lead = M.stated_lead[i] * state.v_command[i]
    want: float = state.q_command[i] + lead
    if M.sees:
        use = M.used[i]
        more = use[0] * state.v_command[i] - lead + max(use[1], 0.0) * state.a_command[i] + use[3]
        want += certain(more + use[4] * M.weight[i], M.unsure[i])
    return want


@jit
def asks_all(K: Any, i: int) -> bool:
    """Whether the command leads joint i, which rests, by as much as it may."""
    M = K.monitor
    return bool(M.rests[i] and abs(K.gate.sent[i] - seen_now(K, i)) > ALL * M.room[i])


@jit
def lead_joint(K: Any, i: int, bounded: bool) -> float:
    """What is sent to joint i, position and velocity; by how much of its bound that is held back."""
    M, state, last = K.monitor, K.state, K.gate.sent[i]
    q = state.q_command[i]
    asked = want = wanted(K, i)
    held_back = now = room = 0.0
    if bounded:
        now, room = seen_now(K, i), M.room[i]
        if M.names and M.G_lock[i] > M.level and may_stick(K, i):  # friction may hold it: it is asked for all
            want = now + (room if M.r[i] > 0.0 else -room)
        if want > now + room:
            want = max(now + room, min(last, want))
        elif want < now - room:
            want = min(now - room, max(last, want))
        held_back = abs(want - asked) / room
    way = way_of(K, i)
    want = min(max(want, last - way), last + way)
    if bounded and K.feedback.thrown > 0.0:  # it goes along with what a blow has thrown, lest that flies back
        way = state.dt * min(K.limits.v_max[i], UNLIMITED)
        want = min(max(want, min(now - room, last + way)), max(now + room, last - way))
    low, high = min(K.limits.q_min[i], q, last), max(K.limits.q_max[i], q, last)
    want = min(max(want, low), high)
    K.feedback.q_sent[i] = want
    if M.sees:  # a speed that comes from another signal than the position would be a fault of its own
        K.feedback.v_sent[i] = (want - last) / state.dt
    else:
        K.feedback.v_sent[i] += M.stated_lead[i] * state.a_command[i]
    return float(held_back)


@jit
def ahead(K: Any, i: int) -> float:
    """By what the speed of joint i is led on an arm that takes velocities: c a_r, as far as c is known."""
    M = K.monitor
    return float(certain(M.used[i, 0], M.P[i, 0, 0]) * K.state.a_command[i]) if M.sees else 0.0


@jit
def held_by(K: Any, i: int) -> float:
    """Bandwidth of the loop around joint i of an arm that takes velocities: half its rotor's, at most.

    That is m + i M_ii, what the arm's own inertia does at its place included.
    """
    M, P, own, most = K.monitor, K.monitor.P[i], K.monitor.own[i], K.feedback.hold
    var = P[1, 1] + own * (2.0 * P[1, 5] + own * P[5, 5])
    rotor = max(certain(M.used[i, 1] + own * M.used[i, 5], var), 0.0) if M.sees else 0.0
    return float(1.0 / max(1.0 / most, 2.0 * sqrt(rotor)))


@jit
def _push_by_speed(K: Any, i: int) -> None:
    """The same of an arm that takes velocities: there and back, slowly, lest it leaps when a brake opens."""
    M, last, way = K.monitor, K.gate.speed[i], K.limits.a_max[i] * K.state.dt
    turns = int((K.state.ticks - M.found_at[i]) * K.state.dt / TURNS)
    v = (M.tell[i] if turns % 2 == 0 else -M.tell[i]) / TURNS
    K.feedback.v_sent[i] = min(max(v, last - way), last + way)


@jit
def keep_found(K: Any, i: int) -> bool:
    """A joint that was found to be locked is sent where it stands, and a little farther where that moves it.

    Whether it was.
    """
    M, last = K.monitor, K.gate.sent[i]
    goal = M.place[i] + (M.tell[i] + M.droop[i] if K.feedback.kind == POSITION_DRIVE else 0.0)
    if M.found[i] != IS_LOCKED or not is_finite(goal):
        return False
    way = RETURNS * K.state.dt * min(K.limits.v_max[i], UNLIMITED)
    low, high = min(K.limits.q_min[i], last), max(K.limits.q_max[i], last)
    K.feedback.q_sent[i] = min(max(min(max(goal, last - way), last + way), low), high)
    K.feedback.v_sent[i] = 0.0
    if K.feedback.kind == VELOCITY_DRIVE:
        _push_by_speed(K, i)
    return True
