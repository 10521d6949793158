"""The whole arm is held: one hypothesis before all others, which accuses no joint.

All joints that work stand, at once, though some of them should move: a protective stop, a dead-man's switch,
a power dip. Nothing is learned then, nobody is suspected, no leader's time runs, and what is sent goes back
to where the arm stands and a little ahead of that, so that it shows when it is let go.
Source: docs/theory/feedback.md, "A whole arm that is held".
"""

from math import sqrt
from typing import Any

from ftqp.kernel.arm.kinematics import mimic_places
from ftqp.kernel.feedback.persistence import reset_counter
from ftqp.kernel.feedback.samples import is_blind, slot
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import NOTHING_HEARD, POSITION_DRIVE, TORQUE_DRIVE
from ftqp.kernel.layout.thresholds import FASTEST, UNLIMITED
from ftqp.kernel.maths.elementary import is_finite
from ftqp.kernel.monitor.servos import as_before, is_strained

LEARNS, CLIP, LEAST_NOISE, NOISIEST = 0.005, 25.0, 1e-11, 0.005
"""Share of a sample in the noise that is learned from third differences, whose variance is 20 times a
sample's; what counts of one is at most so many times what was learned, and so much [rad2]; a joint whose
encoder scatters by more than the last one [rad or m] has a sensor that fails."""
FIRST = 197
"""What is learned of a torque arm's so many first samples is their mean, as of the later ones."""
FILTER = 0.006
"""Time constant [s] of the speed that samples show ..."""
STANDS, STANDS_SIGMAS = 0.012, 3.0
"""A joint whose filtered speed is below this [rad/s or m/s], and so many standard deviations of a sample over
the filter's time, is slow; ..."""
PLACE_SIGMAS = 6.0
"""... one that stays within so many standard deviations of a sample, four and more of the difference of two,
of a place which goes after it at this speed, stands, at once and not when a filter has forgotten, ..."""
ROUNDING = 1e-12
"""Differences of samples below this [rad or m] are rounding."""
SHOULD = 4.0
"""... and one that is sent so many times as fast, or as far, should move, or is seen to move; ..."""
STEPS = 2.0
"""... once it was sent by so many of its encoder's smallest steps, as a slow one repeats itself."""
STOOD, SAMPLES = 0.012, 2.0
"""For so long [s], and for more than so many ticks, all joints have to stand, as one sample that comes twice
shows nothing, ..."""
JUST = 0.05
"""... those that moved not longer ago than this [s], or than twice so many ticks, ..."""
ASKED, FAR = 0.1, 0.005
"""... or that were sent so far [rad or m], beside noise, while all have stood for so long [s], as the slowest
servos need to show that they move; one such joint alone is locked, while the others rest."""
USUAL_TIME = 0.2
"""Time constant [s] of how far ahead of an arm that moves its command usually is, or of what disturbs it."""
EXCESS, EXCESS_SIGMAS = 0.002, 12.0
"""So far [rad or m] beside noise, which is more than twice ``GONE``, is a held arm sent ahead, ..."""
MOST = 0.015
"""... at most so far, ..."""
GROWS, GROWS_BY_TORQUE = 5e-4, 0.02
"""... and so much farther a second [rad/s or m/s], because dry friction may hold an arm that was let go; more
on an arm that takes torques, whose spring is soft; ..."""
HELD_VELOCITY = 0.02
"""... or so fast where it takes velocities [rad/s or m/s]."""
BACK = 0.5
"""Share of its speed limit at which the command goes back to a joint that is held."""
GONE, GONE_SIGMAS = 6e-4, 8.0
"""A joint that goes so far ahead [rad or m], and so many standard deviations of a sample, was let go."""
MOVED = 0.01
"""A held joint that is farther from its place than it goes at its limit in this time [s] was moved there."""


@jit
def _forget(held: Any, n: int) -> None:
    """Nothing has been seen of the arm lately."""
    held.stood = held.still = held.since = 0.0
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
        held.begun[i], held.at[i], held.near[i] = K.past.q[then, i], held.last[i], held.last[i]
        held.moved_lately[i] = 0.0 if abs(v) < should else (JUST if v > 0.0 else -JUST)


@jit
def _toward(value: float, end: float, most: float) -> float:
    """``value`` brought nearer to ``end`` by no more than ``most``."""
    return min(max(end, value - most), value + most)


@jit
def _learn_noise(K: Any, i: int, sample: float) -> None:
    """The standard deviation of joint i's samples, by y - 3 y1 + 3 y2 - y3; never below the stated one."""
    held, stated = K.held, K.feedback.sigma
    d = sample - 3.0 * (held.last[i] - held.older[0, i]) - held.older[1, i]
    known = held.sigma[i] * held.sigma[i]
    share, most = LEARNS, CLIP * known + LEAST_NOISE
    if K.feedback.kind == TORQUE_DRIVE and held.sees < FIRST:  # its loop passes noise on from the first tick
        share, most = 1.0 / (3.0 + held.sees), NOISIEST * NOISIEST
    known += share * (min(d * d / 20.0, most) - known)
    held.sigma[i] = max(min(sqrt(known), NOISIEST), stated)
    held.older[1, i], held.older[0, i], held.last[i] = held.older[0, i], held.last[i], sample


@jit
def _stands(K: Any, then: int, dt: float) -> bool:
    """Whether all joints that work stand, and enough of them though they should move.

    One is enough that has just moved, unless its encoder is doubted: what it says shows nothing then.
    """
    held, feedback, faults = K.held, K.feedback, K.faults
    share, slow = min(1.0, dt / FILTER), min(1.0, dt / USUAL_TIME)
    lately, asked, moved = max(JUST, 2.0 * SAMPLES * K.state.dt), 0, 0
    all_stand = True
    for k in range(faults.working):
        i = faults.order[k]
        sample = K.state.q[i]
        if not is_finite(sample):
            all_stand = False
            continue
        speed = min(max((sample - held.last[i]) / dt, -FASTEST), FASTEST)
        held.speed[i] = speed = held.speed[i] + share * (speed - held.speed[i])
        _learn_noise(K, i, sample)
        sigma = held.sigma[i]
        still = STANDS + STANDS_SIGMAS * sigma / FILTER
        should = SHOULD * still
        if held.on:
            continue
        held.near[i] = _toward(held.near[i], sample, STANDS * dt)
        if abs(sample - held.near[i]) > PLACE_SIGMAS * sigma + ROUNDING:
            all_stand = all_stand and is_strained(K, i)  # what its load moves says nothing
            held.near[i] = sample
        if abs(speed) > still:
            usual = feedback.d_slow[i] if feedback.kind == TORQUE_DRIVE else K.past.q[then, i] - sample
            held.baseline[i] += slow * (usual - held.baseline[i])
        if abs(speed) > should:
            held.moved_lately[i] = lately if speed > 0.0 else -lately
        else:
            held.moved_lately[i] = _toward(held.moved_lately[i], 0.0, dt)
        v, asked_way = K.past.v[then, i], K.past.q[then, i] - held.begun[i]
        just = (
            abs(v) > should
            and v * held.moved_lately[i] > 0.0
            and abs(asked_way) > STEPS * feedback.increment[i]
        )
        most = FAR + EXCESS_SIGMAS * sigma + SHOULD * abs(sample - held.at[i])
        far = held.still > ASKED and abs(asked_way) > most
        held.way[i] = 1.0 if (v if just else asked_way) > 0.0 else -1.0
        held.asked[i] = 1.0 if just or far else 0.0
        asked += 1 if (just or far) and K.chain.lead[i] == i else 0
        moved += 1 if just and K.chain.lead[i] == i and feedback.bad[i] == 0 else 0
    held.sees = min(held.sees + 1, FIRST)
    held.still += dt
    if not all_stand:
        held.still = 0.0
        for i in range(K.chain.n):
            held.begun[i], held.at[i] = K.past.q[then, i], held.last[i]
    alone = moved > 0 and held.alone == 0
    return all_stand and asked >= min(1 if alone else 2, faults.working)


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
        feedback.unresponsive[i] = 0
        reset_counter(feedback, i)
    feedback.unresponsive_count = 0


@jit
def _stay(K: Any, dt: float) -> bool:
    """A tick of an arm that is held: where it is sent, and whether it is still held."""
    held, feedback, faults, gate, limits = K.held, K.feedback, K.faults, K.gate, K.limits
    grows = GROWS_BY_TORQUE if feedback.kind == TORQUE_DRIVE else GROWS
    held.ahead = min(held.ahead + grows * dt, MOST)
    released = asked = 0
    for k in range(faults.working):
        i = faults.order[k]
        ahead = held.ahead + EXCESS_SIGMAS * held.sigma[i]
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
            q = _toward(gate.q[i], q + held.baseline[i], BACK * top * dt)
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
            feedback.d_hat[i] = feedback.d_slow[i] = held.baseline[i]


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
