"""The whole arm is held: one hypothesis before all others, which accuses no joint.

All joints that work stand, at once, though some of them should move: a protective stop, a dead-man's switch,
a power dip. Nothing is learned then, nobody is suspected, no leader's time runs, and what is sent goes back
to where the arm stands and a little ahead of that, so that it shows when it is let go.
Source: docs/theory/feedback.md, "A whole arm that is held".
"""

from math import inf
from typing import Any

from ftqp.kernel.arm.kinematics import followers, mimic_places
from ftqp.kernel.feedback.learned_inertia import forget_since_held
from ftqp.kernel.feedback.persistence import reset_counter
from ftqp.kernel.feedback.repeats import KNOWN_FOR
from ftqp.kernel.feedback.samples import is_blind, slot
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import NOTHING_HEARD, POSITION_DRIVE, TORQUE_DRIVE
from ftqp.kernel.layout.thresholds import COARSEST, FASTEST, NOISE_LEVELS, RETURNS, ROUNDING, UNLIMITED
from ftqp.kernel.maths.elementary import any_of, is_finite, larger, mul_add, select, smaller, sqrt
from ftqp.kernel.maths.side_by_side import (
    WIDTH,
    all_of,
    is_set,
    lane_mask,
    load_lanes,
    store_lanes,
    sum_of,
)
from ftqp.kernel.monitor.evidence import USUAL_TIME
from ftqp.kernel.monitor.servos import as_before, strains
from ftqp.kernel.monitor.verdicts import BLURS, EXCESS, MOST

CLIP, LEAST, UNKNOWN = 25.0, 3e-6, 1e-3
"""What counts of a difference is at most so many times the variance that was learned, and so much [rad or m],
which is the least noise; before any was seen and where nothing is stated it is taken for the last one."""
RISES, QUARTER = 0.05, 3.14
"""A quarter of all differences is below what is usual: it rises by this share where one is above, and falls
by three times that where it is not. Of normal ones a deviation is so many times a quarter."""
STOOD, SAMPLES = 0.012, 2.0
"""For so long [s], and for more than so many ticks, all joints have to stand, as one sample that comes twice
shows nothing."""
FILTER, STANDS, STANDS_SIGMAS = 0.5 * STOOD, 0.012, 3.0
"""A joint whose speed behind a filter of this time constant [s] is below this [rad/s or m/s], and so many
standard deviations of a sample over that time, is slow; one whose samples stay near a place which goes after
them at this speed stands, at once and not when a filter has forgotten, ..."""
SHOULD = 4.0
"""... and one that is sent so many times as fast, or as far, should move, or is seen to move; ..."""
STEPS = 2.0
"""... once it was sent by so many of its encoder's smallest steps, as a slow one repeats itself."""
JUST = 0.05
"""Those count that moved not longer ago than this [s], or than twice so many ticks."""
MOST_BY_TORQUE = 24.0
"""A held torque arm is sent ahead at least so far that its loop asks for this [rad/s2 or m/s2]: by 15 mrad at
40 1/s."""
CREEPS, CREEPS_BY_SERVO = 0.02, 5e-4
"""A held arm is sent ahead by the excess of a joint that is held, and farther so fast [rad/s or m/s], because
dry friction may hold an arm that was let go: faster where no servo holds it, and so fast where it takes
velocities."""
GONE, GONE_SIGMAS = 6e-4, 8.0
"""A joint that goes so far ahead [rad or m], and so many standard deviations of a sample, was let go."""
MOVED = 0.01
"""A held joint that is farther from its place than it goes at its limit in this time [s] was moved there."""


@jit
def _forget(held: Any, n: int) -> None:
    """Nothing has been seen of the arm lately."""
    held.stood = held.since = 0.0
    held.sees = 0
    for i in range(n):
        held.asked[i] = held.moved_lately[i] = 0.0


@rare_jit
def _begin(K: Any, then: int) -> None:
    """The first sample of an arm that does not follow to the last bit: it has followed until now."""
    held, should = K.held, SHOULD * STANDS
    held.sees = 1
    for i in range(K.chain.n):
        v = K.past.v[then, i]
        held.last[i] = K.state.q[i] if is_finite(K.state.q[i]) else K.state.q_command[i]
        held.speed[i] = v
        held.baseline[i] = 0.0
        held.older[0, i] = held.older[1, i] = held.last[i]
        held.begun[i], held.near[i] = K.past.q[then, i], held.last[i]
        held.moved_lately[i] = 0.0 if abs(v) < should else (JUST if v > 0.0 else -JUST)


@jit
def _toward(value: Any, end: Any, most: Any) -> Any:
    """``value`` brought nearer to ``end`` by no more than ``most``."""
    return smaller(larger(end, value - most), value + most)


@jit
def _learn_noise(K: Any, at: int, sample: Any, works: Any) -> Any:
    """The standard deviation of the samples of the joints from ``at`` on; never below the stated one.

    By y - 3 y1 + 3 y2 - y3, which has 20 times the variance of a sample, and beside it by a quarter of them,
    which no few of any size change.
    """
    held, before = K.held, load_lanes(K.held.sigma, at)
    last, older, oldest = (
        load_lanes(held.last, at),
        load_lanes(held.older[0], at),
        load_lanes(held.older[1], at),
    )
    d, known = mul_add(-3.0, last - older, sample - oldest), before * before
    share, most = 1.0 / KNOWN_FOR, mul_add(CLIP, known, LEAST * LEAST)
    if K.feedback.kind == TORQUE_DRIVE and held.sees < KNOWN_FOR:  # its loop passes on noise from the first
        share, most = 1.0 / (3.0 + held.sees), COARSEST * COARSEST
    known = mul_add(share, smaller(0.05 * (d * d), most) - known, known)
    sigma = select(works, larger(smaller(sqrt(known), COARSEST), K.feedback.sigma), before)
    store_lanes(held.sigma, at, sigma)
    usual = load_lanes(held.usual, at)
    above = QUARTER * QUARTER * 0.05 * (d * d) > usual * usual
    usual = larger(usual * select(above, 1.0 + RISES, 1.0 - 3.0 * RISES), LEAST)
    store_lanes(held.usual, at, select(works, usual, load_lanes(held.usual, at)))
    store_lanes(held.older[1], at, select(works, older, oldest))
    store_lanes(held.older[0], at, select(works, last, older))
    store_lanes(held.last, at, select(works, sample, last))
    return sigma


@jit
def _stands_block(K: Any, at: int, then: int, dt: float) -> tuple[bool, float, float]:
    """Of the joints from ``at`` on: whether all that work stand, and how many should move, and should just.

    What its load moves says nothing of a joint.
    """
    held, feedback, M = K.held, K.feedback, K.monitor
    sample, last = load_lanes(K.state.q, at), load_lanes(held.last, at)
    works = lane_mask(K.chain.n, at) & ~is_set(K.faults.code, at)
    silent = works & ~(abs(sample) < inf)
    works = works & ~silent
    rate, before = 1.0 / dt, load_lanes(held.speed, at)
    change = smaller(larger((sample - last) * rate, -FASTEST), FASTEST) - before
    speed = select(works, mul_add(min(1.0, dt / FILTER), change, before), before)
    store_lanes(held.speed, at, speed)
    sigma = _learn_noise(K, at, sample, works)
    if held.on:
        return not any_of(silent), 0.0, 0.0
    still = STANDS + STANDS_SIGMAS / FILTER * sigma
    should = SHOULD * still
    near = _toward(load_lanes(held.near, at), sample, STANDS * dt)
    left = works & (abs(sample - near) > NOISE_LEVELS * sigma + ROUNDING)
    store_lanes(held.near, at, select(works, select(left, sample, near), load_lanes(held.near, at)))
    stands = not any_of(silent)
    if any_of(left):
        top = load_lanes(K.limits.tau_max, at) * load_lanes(M.unit, at)
        a, weight, inertia = load_lanes(M.a, at), load_lanes(M.weight, at), load_lanes(M.inertia, at)
        strained = strains(load_lanes(M.peak_a, at), a, weight, inertia, top)
        stands = stands and feedback.kind != TORQUE_DRIVE and all_of(~left | strained)
    v, sent, ahead = (
        load_lanes(K.past.v[then], at),
        load_lanes(K.past.q[then], at),
        load_lanes(held.baseline, at),
    )
    usual = load_lanes(feedback.tau_slow, at) if feedback.kind == TORQUE_DRIVE else sent - sample
    usual = mul_add(min(1.0, dt / USUAL_TIME), usual - ahead, ahead)
    store_lanes(held.baseline, at, select(works & (abs(speed) > still), usual, ahead))
    lately, before = max(JUST, 2.0 * SAMPLES * K.state.dt), load_lanes(held.moved_lately, at)
    moved = select(speed > 0.0, lately, -lately)
    moved = select(abs(speed) > should, moved, _toward(before, 0.0, dt))
    store_lanes(held.moved_lately, at, select(works, moved, before))
    way = sent - load_lanes(held.begun, at)
    just = (abs(v) > should) & (v * moved > 0.0) & (abs(way) > STEPS * load_lanes(feedback.increment, at))
    forward = select(select(just, v, way) > 0.0, 1.0, -1.0)
    store_lanes(held.way, at, select(works, forward, load_lanes(held.way, at)))
    asked = select(just, 1.0, 0.0)
    store_lanes(held.asked, at, select(works, asked, load_lanes(held.asked, at)))
    leads = works & ~followers(K.chain, at) if K.chain.mimics else works
    moved = select(leads & just & ~is_set(feedback.bad, at), asked, 0.0)
    return stands, sum_of(select(leads, asked, 0.0)), sum_of(moved)


@jit
def _stands(K: Any, then: int, dt: float) -> bool:
    """Whether all joints that work stand, and enough of them though they should move.

    One is enough that has just moved, unless its encoder is doubted: what it says shows nothing then.
    """
    held, all_stand, asked, moved = K.held, True, 0.0, 0.0
    for at in range(0, K.chain.n, WIDTH):
        stand, more, just = _stands_block(K, at, then, dt)
        all_stand, asked, moved = all_stand and stand, asked + more, moved + just
    held.sees = min(held.sees + 1, KNOWN_FOR)
    if not all_stand:
        for at in range(0, K.chain.n, WIDTH):
            store_lanes(held.begun, at, load_lanes(K.past.q[then], at))
    alone = moved > 0.0 and held.alone == 0
    return bool(all_stand and asked >= min(1 if alone else 2, K.faults.working))


@rare_jit
def hold(K: Any) -> None:
    """From now on the arm is held where it is: the reference rests where the arm was sent last.

    What was suspected of joints since it stands is taken back, whatever it led to but a stop, and so is what
    their servos seemed to be.
    """
    held, feedback, faults, gate = K.held, K.feedback, K.faults, K.gate
    held.on, held.ahead = 1, EXCESS
    for k in range(faults.working):
        i = faults.order[k]
        held.at[i] = held.last[i]
        if K.monitor.on and K.monitor.sees:
            as_before(K.monitor, i)
        if feedback.kind != POSITION_DRIVE:
            gate.q[i] = held.at[i]
        else:
            gate.q[i] = gate.sent[i] - K.monitor.droop[i]
        feedback.held[i] = 0
        reset_counter(feedback, i)
    if feedback.kind == TORQUE_DRIVE:
        forget_since_held(K)


@jit
def _stay(K: Any, dt: float) -> bool:
    """A tick of an arm that is held: where it is sent, and whether it is still held."""
    held, feedback, faults, gate, limits = K.held, K.feedback, K.faults, K.gate, K.limits
    creeps, most = CREEPS_BY_SERVO, MOST
    if feedback.kind == TORQUE_DRIVE:
        most = max(MOST, MOST_BY_TORQUE / (feedback.stiffness * feedback.stiffness))
        creeps = CREEPS * most / MOST
    held.ahead = min(held.ahead + creeps * dt, most)
    released = asked = 0
    for k in range(faults.working):
        i = faults.order[k]
        ahead = held.ahead + BLURS * held.sigma[i]
        far = GONE + GONE_SIGMAS * held.sigma[i]
        top = min(limits.v_max[i], UNLIMITED)
        off = held.last[i] - held.at[i]
        if held.way[i] * off > far:
            released += 1
            asked += 1 if held.asked[i] != 0.0 else 0
        elif abs(off) > MOVED * top + far:
            held.at[i] = held.last[i]
        q = held.at[i] + held.way[i] * ahead
        if feedback.kind == POSITION_DRIVE:
            q = _toward(gate.q[i], q + held.baseline[i], RETURNS * top * dt)
        low, high = min(limits.q_min[i], gate.q[i]), max(limits.q_max[i], gate.q[i])
        gate.q[i] = min(max(q, low), high)
    if released < min(2, faults.working):
        return True
    held.alone = 1 if asked == 0 else 0
    return False


@rare_jit
def _stand(K: Any) -> None:
    """The reference rests at where the arm is sent, and every sample is good that is a number."""
    held, feedback, past, state, gate = K.held, K.feedback, K.past, K.state, K.gate
    feedback.refused = feedback.holding = 0
    if K.chain.mimics:
        mimic_places(K.chain, gate.q)
    for k in range(K.faults.working):
        i = K.faults.order[k]
        q = gate.q[i]
        gate.v[i] = state.v_command[i] = 0.0
        state.q_command[i] = q
        if feedback.kind != POSITION_DRIVE:  # what a servo was sent stays, with its droop
            gate.sent[i] = q
        for s in range(feedback.span):
            past.q[s, i], past.v[s, i], past.a[s, i] = q, 0.0, 0.0
        if not feedback.lost[i]:
            feedback.seen[i] = feedback.good[i] = held.last[i]
            feedback.offset[i] = held.last[i] - q
            feedback.bad[i] = feedback.age[i] = 0
            feedback.spent[i] = 0.0
        if feedback.kind == TORQUE_DRIVE:
            feedback.tau_slow[i] = held.baseline[i]
            feedback.d_hat[i] = held.baseline[i] / feedback.M[i, i] if feedback.M[i, i] > 0.0 else 0.0


@jit
def watch_arm(K: Any, first: bool) -> None:
    """Whether the whole arm is held, or was let go; beside a free-swinging joint nobody knows.

    Samples are looked at as they came, before anybody believes or doubts them.
    """
    held, feedback, faults = K.held, K.feedback, K.faults
    if first or faults.movable > faults.working or (feedback.exact and not held.on):
        held.on = 0
        if held.sees or first:
            held.alone = 0
            _forget(held, K.chain.n)
        if first:
            for i in range(K.chain.n):
                held.sigma[i] = feedback.sigma
                held.usual[i] = feedback.sigma if feedback.sigma > 0.0 else UNKNOWN
        return
    held.since += K.state.dt
    if K.state.unusable == NOTHING_HEARD or is_blind(feedback):
        return
    then, dt = slot(feedback, feedback.latency), held.since
    held.since = 0.0
    if not held.sees:
        _begin(K, then)
        return
    stands = _stands(K, then, dt)
    if not held.on:
        held.stood = held.stood + dt if stands else 0.0
        if held.stood <= max(STOOD, SAMPLES * K.state.dt) and not K.monitor.holds:
            return
        K.monitor.holds = 0
        hold(K)
    stays = _stay(K, dt)
    _stand(K)
    if not stays:
        held.on = 0
        _forget(held, K.chain.n)
