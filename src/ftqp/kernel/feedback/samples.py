"""Each joint's measured position is accepted, or gives way to what is expected."""

from math import inf, nan, pi
from typing import Any

from ftqp.kernel.feedback.persistence import reset_counter
from ftqp.kernel.feedback.repeats import (
    IN_DOUBT,
    all_repeat_oddly,
    explain,
    forget_repeats,
    learn_block,
    look_at_repeats,
    never_repeats,
    no_arm_repeats_so,
    repeat_oddly,
)
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.latches.settling import latch
from ftqp.kernel.layout.enums import (
    AS_SENT,
    FREE,
    FROZEN,
    HEALTHY,
    LOOKED_THROUGH,
    MEASURED,
    NOT_FINITE,
    NOTHING_HEARD,
    POSITION_DRIVE,
    STOPPED_BY_SENSOR,
    TORQUE_DRIVE,
    VELOCITY_DRIVE,
)
from ftqp.kernel.layout.thresholds import COARSEST, FASTEST, MOST_TICKS
from ftqp.kernel.maths.elementary import (
    any_of,
    has_last_row,
    is_finite,
    larger,
    select,
    whole_turns,
)
from ftqp.kernel.maths.side_by_side import WIDTH, all_of, is_set, load_lanes, store_lanes

SPEED_SHARE = 1.3
"""A joint may be this many times as fast as its velocity limit for one sample."""
SIGMAS = 8.5
"""6 sqrt(2) standard deviations of a sample, because the test looks at the difference of two: noise alone
exceeds six twice in 1e9 samples."""
ROOM = 1e-4
"""Room [rad or m] that is left whatever else is known."""
FREE_SPEED = 15.0
"""A free-swinging joint may be this fast [rad/s] although its own limit is lower."""
IMPACT_TIME = 0.1
"""After an impact at the end of a range joints may be faster than their limits for so long [s] ..."""
HITS = 0.3
"""... if one was seen to come there at this speed [rad/s or m/s] ..."""
NEAR_END = 5e-3
"""... and to be so near to it [rad or m], beside what it goes in two ticks."""
RECOVERY = 1.0
"""A good sample takes back this share of what a bad one costs: a sensor is lost that is mostly wrong."""
AT_MOST = 1.5
"""A sample's standard deviation is at most so many times what is usual, which is known to a quarter."""
SILENCE, BLIND = 1.0, 0.3
"""For so long [s] an arm waits for samples when none of its joints says a number: that is the line, and no
sensor's fault; and one that takes torques, which no servo holds, so that what its model misses grows as a
pendulum falls."""


@jit
def slot(feedback: Any, ago: int) -> int:
    """Where the ring keeps the tick that was ``ago`` ticks before this one."""
    index = feedback.now - ago
    return index if index >= 0 else index + feedback.span


@jit
def is_blind(feedback: Any) -> bool:
    """Whether a torque arm hears nothing: no servo holds it, and its model alone says where it goes."""
    blind: bool = feedback.silent > 0.0 and feedback.kind == TORQUE_DRIVE
    return blind


@rare_jit
def begin(K: Any) -> None:
    """After a reset: the arm is where it was said to be, and nothing is known of what came before.

    After a tick whose command was not let through, too; the arm is then where it is measured, if that is a
    number, and a sensor that was lost stays so.
    """
    feedback, past, state = K.feedback, K.past, K.state
    n = K.chain.n
    anew = feedback.fresh != AS_SENT
    feedback.fresh = 0
    feedback.now = 0
    feedback.refused = feedback.holding = feedback.exact = feedback.lagging = feedback.far = 0
    feedback.gap = feedback.rate_change = feedback.late = feedback.up = 0.0
    feedback.silent = feedback.wide = feedback.thrown = 0.0
    feedback.spent_elsewhere = 0.0
    feedback.rate = 1.0
    feedback.speed_margin = 0.0
    feedback.quiet = feedback.samples = 0
    feedback.softened = feedback.touched = 0
    feedback.time_error = 0.0
    feedback.stored = feedback.until_stored = 0
    feedback.isolated_joint = -1
    for k in range(6):
        feedback.c[k] = feedback.c_rate[k] = feedback.push[k] = feedback.off[k] = 0.0
    for i in range(n):
        q, v = state.q_command[i], state.v_command[i]
        if anew:
            feedback.step[i], feedback.step_at[i] = 0.0, -1
        at = q if anew or not is_finite(state.q[i]) else state.q[i] - feedback.step[i]
        feedback.angle[i] = nan
        feedback.seen[i] = feedback.good[i] = feedback.foretold[i] = at
        feedback.q_hat[i] = feedback.q_now[i] = at
        feedback.v_hat[i] = feedback.v_now[i] = feedback.v_sent[i] = v
        feedback.d_hat[i] = feedback.tau_slow[i] = 0.0
        feedback.offset[i] = at - q
        feedback.age[i] = feedback.still[i] = feedback.bad[i] = 0
        forget_repeats(feedback, i, at)
        reset_counter(feedback, i)
        if anew:
            feedback.spent[i] = 0.0
            feedback.lost[i] = feedback.asks[i] = 0
            feedback.known_failed[i] = 0 if K.faults.code[K.chain.lead[i]] == HEALTHY else 1
        feedback.wound[i] = feedback.baseline[i] = feedback.missing[i] = 0.0
        for s in range(feedback.span):
            past.q[s, i], past.v[s, i], past.a[s, i], past.tau[s, i] = q, v, 0.0, 0.0
    for s in range(feedback.span):
        past.known[s] = 0


@jit
def _noise(K: Any, usual: Any) -> Any:
    """The standard deviation of samples that are not wrong [rad or m], whatever some others say.

    It is the stated one where more is seen by nobody, and of an arm that follows to the last bit.
    """
    seen = AT_MOST if K.held.sees else 0.0
    return larger(seen * usual, K.feedback.sigma)


@jit
def _grain(known: Any, change: Any, noise: Any) -> Any:
    """The smallest step between samples that noise does not make, and with it that of a coarse encoder."""
    step = abs(change)
    return select((step > noise) & (step <= COARSEST) & ((step < known) | (known <= noise)), step, known)


@jit
def _is_possible(
    state: Any, faults: Any, limits: Any, feedback: Any, sigma: float, i: int, sample: float, v: float
) -> bool:
    """|q_m - q_good - t v_r| <= 1.3 v_max dt + a_max t^2 + 8.5 sigma + 1e-4, t the time since q_good.

    sigma was stated or learned, whatever is more, and an encoder's step goes beside it. Or with the speed
    that was observed in the place of v_r: a joint that does not obey is seen, too. After an impact at the
    end of a range it is 30 rad/s in the place of v_max for 100 ms. While nothing was heard it may have stood.
    What lasts for half of patience and is no more than the step of a coarse encoder may be one.
    """
    dt = state.dt
    if not is_finite(sample):
        return False
    t = feedback.age[i] * dt
    if feedback.unheard > 0.0:
        t = max(t, dt * (feedback.same[i] + 1.0))
    top = max(limits.v_max[i], abs(v), abs(feedback.v_hat[i]))  # a limit that has just been lowered
    if faults.code[i] == FREE or faults.code[i] == MEASURED:
        top = max(top, FREE_SPEED)
    if feedback.wide > 0.0:
        top = max(top, FASTEST)
    if not top < inf:
        return True
    room = SPEED_SHARE * top * dt + limits.a_max[i] * t * t + SIGMAS * sigma + ROOM
    room += COARSEST if t > 0.5 * feedback.patience else feedback.grain[i]
    way = sample - feedback.good[i]
    if feedback.unheard > 0.0 and abs(way) <= room:
        return True
    return abs(way - t * v) <= room or abs(way - t * feedback.v_hat[i]) <= room  # as sent, or as it was seen


@rare_jit
def _note_jumps(K: Any, at: int, then: int) -> None:
    """How far the samples of the joints from ``at`` on went beside what was sent since the last good ones."""
    feedback, dt = K.feedback, K.state.dt
    for i in range(at, K.chain.n):
        t = (feedback.age[i] + 1.0) * dt
        feedback.jump[i] = K.state.q[i] - feedback.good[i] - t * K.past.v[then, i]


@rare_jit
def _time_error(K: Any, i: int, then: int) -> float:
    """How late the samples of the joints other than i seem to be, all alike [s]: jump_j = -delta v_j.

    Least squares, of a delta that is 0 give or take five periods. A sensor that jumps alone is not excused.
    """
    feedback, total = K.feedback, 0.0
    known = 1.0 / (MOST_TICKS * K.state.dt) ** 2
    for j in range(K.chain.n):
        if j == i or K.faults.code[j] != HEALTHY or feedback.lost[j] or not is_finite(feedback.jump[j]):
            continue
        blur = SIGMAS * _noise(K, K.held.usual[j]) + ROOM
        blur += feedback.grain[j]
        v = K.past.v[then, j] / blur
        total -= v * feedback.jump[j] / blur
        known += v * v
    return float(total / known)


@rare_jit
def _comes_mistimed(K: Any, i: int, then: int, v: float) -> bool:
    """Whether a sample that cannot be true is, had it come as late or early as those of the others did."""
    feedback, late = K.feedback, _time_error(K, i, then)
    sigma, at = _noise(K, K.held.usual[i]), K.state.q[i] + v * late
    if not _is_possible(K.state, K.faults, K.limits, feedback, sigma, i, at, v):
        return False
    if abs(late) > abs(feedback.time_error):
        feedback.time_error = late
    return True


@jit
def _shows_last_wrong(K: Any, i: int, sigma: float, sample: float, v: float) -> bool:
    """Whether a sample goes on from the last ones that went with each other, and not from the last good one.

    That was wrong then. A sensor that has jumped stays where it is.
    """
    feedback, last = K.feedback, K.feedback.good[i]
    feedback.good[i] = feedback.foretold[i]
    follows = _is_possible(K.state, K.faults, K.limits, feedback, sigma, i, sample, v)
    feedback.good[i] = last
    return bool(follows)


@rare_jit
def _has_jumped(K: Any, i: int, then: int, sigma: float) -> bool:
    """Whether the encoder of joint i has jumped and works on: from now on its step is taken from its numbers.

    No joint can go so far in a tick, nor has an encoder such steps, and from then on, for as long as patience
    lasts, the joint goes as it was sent, a_max t^2 and noise aside. The step is the first of these numbers
    less where the joint was observed to go.
    Source: docs/theory/feedback.md, "Samples".
    """
    feedback, state, sample = K.feedback, K.state, K.state.q[i]
    fixed = SIGMAS * sigma + ROOM + feedback.grain[i]
    t = feedback.age[i] * state.dt
    if feedback.age[i] == 1:
        known = K.held.sees > 1 and feedback.wide == 0.0 and abs(feedback.moved[i]) <= fixed
        feedback.jumps[i] = sample - feedback.q_hat[i] - state.dt * feedback.v_hat[i] if known else nan
    step = feedback.jumps[i]
    off = sample - step - K.past.q[then, i] - feedback.offset[i]
    if not (abs(step) > COARSEST and abs(off) <= K.limits.a_max[i] * t * t + fixed):
        feedback.jumps[i] = nan
    if not is_finite(feedback.jumps[i]) or t <= feedback.patience + 0.5 * state.dt:
        return False
    state.q[i] -= step
    feedback.angle[i] -= step
    feedback.raw[i] -= step
    feedback.step[i] += step
    feedback.step_at[i] = state.ticks
    K.monitor.news = 1
    return True


@jit
def _may_jump(K: Any, i: int) -> bool:
    """Whether a jump of joint i's encoder can be told from all else that makes its numbers impossible."""
    feedback = K.feedback
    works = K.faults.code[K.chain.lead[i]] == HEALTHY and feedback.lost[i] == 0 and K.monitor.names != 0
    heard = feedback.silent == 0.0 and feedback.unheard == 0.0
    return bool(works and heard and feedback.kind != POSITION_DRIVE)


@jit
def _spend(state: Any, watch: Any, feedback: Any, spent: float, cost: float, stops: bool) -> float:
    """The leaky count of bad samples as time [s]; the arm is stopped when patience is at an end.

    ``cost``: of this sample as a share of a tick, 0 of a good one; ``stops``: nobody else judges.
    """
    dt = state.dt
    if cost == 0.0:
        return max(0.0, spent - RECOVERY * dt)
    spent += cost * dt
    if stops and spent > feedback.patience + 0.5 * dt and watch.latched == 0:
        latch(watch, STOPPED_BY_SENSOR)
    return spent


@jit
def _drop_broken_tip(task: Any) -> bool:
    """Whether a tip was measured that is not finite, or is transposed; it then counts as not measured."""
    if not task.has_tip_measured:
        return False
    T = task.tip_measured
    good = has_last_row(T[3, 0], T[3, 1], T[3, 2], T[3, 3])
    for r in range(4):
        for c in range(4):
            good = good and is_finite(T[r, c])
    if not good:
        task.has_tip_measured = 0
    return not good


@rare_jit
def _struck(K: Any) -> bool:
    """Whether a joint has just come to the end of its range, or is beyond it, at a speed: an impact.

    It throws the others about, too, faster than their limits.
    """
    limits, feedback, dt = K.limits, K.feedback, K.state.dt
    for i in range(K.chain.n):
        v, at = abs(feedback.v_hat[i]), feedback.good[i]
        way = NEAR_END + 2.0 * dt * v
        if v > HITS and (at - limits.q_min[i] < way or limits.q_max[i] - at < way):
            return True
    return False


@rare_jit
def _unwind(K: Any) -> bool:
    """Samples to the turn of those before; whether any joint said a number.

    Sensors begin anew after a turn; what is off by one at the first sample after a reset is somewhere else.
    """
    state, feedback, heard = K.state, K.feedback, False
    for i in range(K.chain.n):
        if is_finite(state.q[i]):
            heard = True
            if not K.chain.prismatic[i]:
                state.q[i] -= 2.0 * pi * whole_turns(state.q[i] - feedback.angle[i])
            feedback.angle[i] = state.q[i]
    return heard


@jit
def _listen(K: Any, then: int) -> None:
    """Takes the samples to their turns, and for how long none of them has said anything new.

    Where no joint says a number, or all repeat theirs though they should not, it is the line that fails.
    """
    state, feedback, news = K.state, K.feedback, False
    feedback.unheard = feedback.silent
    for at in range(0, K.chain.n, WIDTH):
        sample = load_lanes(state.q, at)
        off = abs(sample - load_lanes(feedback.angle, at))
        if not all_of(off <= pi):
            news = _unwind(K)
            break
        news = news or any_of(off > 0.0)
        store_lanes(feedback.angle, at, sample)
    by_torque = feedback.kind == TORQUE_DRIVE
    none = not is_finite(state.q[0])  # else they repeat, as those of an arm that follows exactly may
    counts = (K.monitor.on or by_torque) and state.unusable != NOTHING_HEARD and (none or not feedback.exact)
    if news or not counts:
        feedback.silent = 0.0
    elif none or ((by_torque or all_repeat_oddly(K, then)) and no_arm_repeats_so(K)):
        feedback.silent += state.dt


@jit
def _unless_silent(feedback: Any) -> float:
    """What a sample that cannot be used costs of patience: nothing for a while where none came at all."""
    most = BLIND if feedback.kind == TORQUE_DRIVE else SILENCE
    return 0.0 if 0.0 < feedback.silent < most else 1.0


@jit
def _cost(K: Any, i: int, possible: bool) -> float:
    """What the sample of joint i costs of patience, as a share of a tick: 0 where it is good.

    A sensor that was lost because its number repeated is explained once its joint is said to have failed.
    """
    feedback = K.feedback
    if K.faults.code[K.chain.lead[i]] != HEALTHY and feedback.sigma == 0.0 and explain(feedback, i):
        feedback.lost[i] = 0
        feedback.spent[i] = 0.0
    if feedback.lost[i] != 0 or not possible:
        heard = is_finite(K.state.q[i]) and not is_blind(feedback)
        return 1.0 if heard else _unless_silent(feedback)
    if feedback.held[i] == FROZEN and feedback.silent == 0.0:
        return 1.0 if feedback.sigma > 0.0 or never_repeats(feedback, i) else IN_DOUBT
    return 0.0


@jit
def _believe_joint(K: Any, i: int, then: int) -> None:
    """The sample of joint i, looked at closely."""
    feedback, past, state = K.feedback, K.past, K.state
    sample = state.q[i]
    healthy = K.faults.code[K.chain.lead[i]] == HEALTHY
    code = K.faults.code[K.chain.lead[i]]
    v = feedback.v_hat[i] if code == FREE or code == MEASURED else past.v[then, i]
    feedback.age[i] += 1
    if state.unusable == NOTHING_HEARD:
        feedback.bad[i] = 1
        feedback.seen[i] = past.q[then, i] + (feedback.offset[i] if healthy else 0.0)
        feedback.refused += 1
        return
    sigma = _noise(K, K.held.usual[i])
    possible = _is_possible(state, K.faults, K.limits, feedback, sigma, i, sample, v)
    if feedback.unheard > 0.0 and feedback.silent == 0.0:
        feedback.moved[i] = 0.0  # nothing is learned of a joint that said nothing
    if not possible and feedback.wide == 0.0 and _struck(K):
        feedback.wide = feedback.thrown = IMPACT_TIME
        possible = _is_possible(state, K.faults, K.limits, feedback, sigma, i, sample, v)
    if not possible and is_finite(sample):
        possible = _comes_mistimed(K, i, then, v) or _shows_last_wrong(K, i, sigma, sample, v)
    if not possible and _may_jump(K, i) and _has_jumped(K, i, then, sigma):
        possible, sample = True, state.q[i]
    if healthy or feedback.sigma > 0.0:
        asked = v
        if healthy and feedback.kind == VELOCITY_DRIVE:  # the loop's errors move one that rests
            asked = K.gate.speed[i]
        look_at_repeats(K, i, sample, asked)
    if feedback.held[i] == LOOKED_THROUGH and not possible and not is_blind(feedback):
        feedback.held[i] = FROZEN  # a joint that follows cannot be there any more
    cost = _cost(K, i, possible)
    held = feedback.held[i] == LOOKED_THROUGH
    bad = cost > 0.0 or not is_finite(sample) or feedback.silent > feedback.patience or is_blind(feedback)
    feedback.bad[i] = 1 if bad or held else 0
    judged = K.monitor.on and K.monitor.names and feedback.silent == 0.0
    judged = judged and (K.monitor.found[i] != 0 or (healthy and K.chain.lead[i] == i))
    feedback.spent[i] = _spend(state, K.watch, feedback, feedback.spent[i], cost, not judged)
    if feedback.bad[i] == 0 or (not bad and feedback.kind != TORQUE_DRIVE):
        feedback.grain[i] = _grain(feedback.grain[i], sample - feedback.good[i], SIGMAS * sigma)
        way, seen = feedback.age[i] * state.dt * v, feedback.good[i]
        room = SIGMAS * sigma + ROOM + feedback.grain[i]
        feedback.foretold[i] = way + (seen if abs(sample - seen - way) <= room else feedback.foretold[i])
        feedback.seen[i] = feedback.good[i] = sample
        feedback.offset[i] = sample - past.q[then, i]
        feedback.age[i] = 0
    else:
        off = feedback.offset[i] if healthy else 0.0  # a failed joint's is its reference
        feedback.seen[i] = past.q[then, i] + off
    if held:
        feedback.holding += 1
    elif bad:
        feedback.refused += 1 if healthy or not feedback.lost[i] else 0
        if feedback.spent[i] > feedback.patience + 0.5 * state.dt:
            feedback.lost[i] = 1


@jit
def _believe_block(K: Any, at: int, then: int) -> bool:
    """The samples of the joints from ``at`` on, taken as they are; False where one needs a closer look.

    They are taken where all were good a tick ago, all are possible now, as ``_is_possible`` has it, and none
    repeats oddly.
    """
    state, limits, feedback, past = K.state, K.limits, K.feedback, K.past
    if feedback.silent > 0.0 or feedback.unheard > 0.0:
        return False
    odd = is_set(feedback.age, at) | is_set(feedback.lost, at) | is_set(feedback.bad, at)
    if any_of(odd):
        return False
    dt = state.dt
    sample, v, q = load_lanes(state.q, at), load_lanes(past.v[then], at), load_lanes(past.q[then], at)
    top = larger(larger(load_lanes(limits.v_max, at), abs(v)), abs(load_lanes(feedback.v_hat, at)))
    noise, grain = SIGMAS * _noise(K, load_lanes(K.held.usual, at)), load_lanes(feedback.grain, at)
    fixed = noise + ROOM + grain
    room = SPEED_SHARE * dt * top + dt * dt * load_lanes(limits.a_max, at) + fixed
    way, good = dt * v, load_lanes(feedback.good, at)
    off = abs(sample - good - way)
    if not all_of((off <= room) & (abs(sample) < inf)):
        return False
    noisy = feedback.sigma > 0.0
    if noisy or not feedback.exact:  # of an arm that follows exactly nothing is to be learned
        asked = load_lanes(K.gate.speed, at) if feedback.kind == VELOCITY_DRIVE else v
        if any_of(repeat_oddly(state, feedback, at, sample, asked, noisy)):
            return False
        learn_block(state, feedback, at, sample, asked)
    store_lanes(feedback.grain, at, _grain(grain, sample - good, noise))
    store_lanes(feedback.jump, at, sample - good - way)
    before = select(off <= fixed, good, load_lanes(feedback.foretold, at))
    store_lanes(feedback.foretold, at, way + before)
    store_lanes(feedback.seen, at, sample)
    store_lanes(feedback.good, at, sample)
    store_lanes(feedback.offset, at, sample - q)
    store_lanes(feedback.spent, at, larger(load_lanes(feedback.spent, at) - RECOVERY * dt, 0.0))
    return True


@rare_jit
def _begin_again(K: Any, then: int) -> None:
    """A torque arm gives samples again: it goes on from where it is, not drawn to where it was sent."""
    feedback, past, gate = K.feedback, K.past, K.gate
    for k in range(K.faults.working):
        i = K.faults.order[k]
        if feedback.bad[i]:
            continue
        off, v = feedback.seen[i] - past.q[then, i], past.v[then, i]
        gate.q[i] += off
        K.state.q_command[i] = gate.q[i]
        for s in range(feedback.span):
            past.q[s, i] += off
        feedback.offset[i] = 0.0
        feedback.q_hat[i], feedback.v_hat[i] = feedback.seen[i] - K.state.dt * v, v


@jit
def believe(K: Any) -> None:
    """q_u: each joint's sample where it is possible, else the reference plus the last good following error.

    The reference of a failed joint is what was seen of it, so that nothing is added to that.

    The sample is that in ``state.q``. A sample that is not finite, farther away than physics allows, or
    frozen is refused; so is every sample of a sensor that counts as lost.
    Source: docs/theory/feedback.md, "Samples".
    """
    feedback, past, state, faults = K.feedback, K.past, K.state, K.faults
    n = K.chain.n
    if feedback.fresh:
        begin(K)
    else:
        feedback.now = feedback.now + 1 if feedback.now + 1 < feedback.span else 0
    now = feedback.now
    then = slot(feedback, feedback.latency)
    feedback.refused = feedback.holding = 0
    if feedback.wide > 0.0:
        feedback.wide = max(0.0, feedback.wide - K.state.dt)
        feedback.thrown = max(0.0, feedback.thrown - K.state.dt)
    elsewhere = _drop_broken_tip(K.task) or state.unusable == NOT_FINITE
    together = faults.movable == faults.working and state.unusable != NOTHING_HEARD
    if state.unusable != NOTHING_HEARD:
        for at in range(0, K.chain.n, WIDTH):
            store_lanes(state.q, at, load_lanes(state.q, at) - load_lanes(feedback.step, at))
    _listen(K, then)
    for at in range(0, K.chain.n, WIDTH):
        store_lanes(past.q[now], at, load_lanes(state.q_command, at))
        store_lanes(past.v[now], at, load_lanes(state.v_command, at))
    for at in range(0, K.chain.n, WIDTH):
        silent = ~(abs(load_lanes(state.q, at)) < inf)  # a sensor that says no number says no speed, either
        elsewhere = elsewhere or not all_of((abs(load_lanes(state.v, at)) < inf) | silent)
        if not together or not _believe_block(K, at, then):
            _note_jumps(K, at, then)
            for i in range(at, min(at + WIDTH, n)):
                _believe_joint(K, i, then)
    if feedback.unheard > feedback.patience and feedback.silent == 0.0 and feedback.kind == TORQUE_DRIVE:
        _begin_again(K, then)
    feedback.spent_elsewhere = _spend(
        state,
        K.watch,
        feedback,
        feedback.spent_elsewhere,
        _unless_silent(feedback) if elsewhere else 0.0,
        True,
    )
    if elsewhere:
        feedback.refused += 1
