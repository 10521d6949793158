"""The joints on their way to a goal, tick by tick: straight, or round what is in between, in Python and C.

Where a way is looked for, the arm comes to rest, the search thinks on in every tick, and its motion is
played. It waits where something holds the arm back, and what is left of it is proven again when the scene
changes. K is a planner's record, A its arm by itself, W its way, J what a tick follows, S the search and its
arm, which a straight way does without, and ``copies`` says what is copied from K to S (``write_together``).
Source: docs/theory/round-obstacles.md.
"""

from math import ceil
from typing import Any

from ftqp.kernel.commands.believed import swings
from ftqp.kernel.commands.going import (
    GOES,
    LARGE,
    RESTS_SOONEST,
    RESTS_TOGETHER,
    begin_anew,
    begins_anew,
    judge_going,
    look_up,
    plan_going,
    short_way,
    wait_anew,
    way_from,
)
from ftqp.kernel.commands.stops import write_together
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import (
    ACCELERATION,
    BRAKING,
    GOING_HALTED,
    GOING_MOVING,
    GOING_REACHED,
    GOING_RESTLESS,
    GOING_UNREACHABLE,
    HEALTHY,
    HELD,
    INVALID_INPUT,
    STOPPED,
    STOPPING,
    TARGET_HAS_ROTATION,
)
from ftqp.kernel.layout.thresholds import (
    ACCELERATION_SHARE,
    BANDWIDTH,
    BANDWIDTH_STEPS,
    DEVIATION,
    LEAST_ACCELERATION,
)
from ftqp.kernel.layout.ways_room import (
    AS_ASKED,
    LEAST_LOOKS,
    LOOKS_A_SECOND,
    NO_REST,
    NO_WAY,
    NONE_FOUND,
    PROOF,
    READY,
    ROUND,
    STRAIGHT,
    TABLE,
)
from ftqp.kernel.maths.jerk_limited import between, state_after
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.search.asking import ask_as_given, begin_asked, cannot_seek, know_asked
from ftqp.kernel.search.known_arm import know_surroundings
from ftqp.kernel.search.looks import passes, pose_arm
from ftqp.kernel.search.motion import places_of, prove_again, sample, search_step
from ftqp.kernel.search.poses import squared, tip_error
from ftqp.kernel.search.trees import add_goal, round_off

A_WAY, A_PROOF = 1, 2
"""What is thought of: a way, or whether what is left of a motion is free."""
AT_ONCE = 4
"""So many times as many while the arm brakes: the sooner there is a motion, the faster the arm still is when
it goes over into it. A guess."""
WAITS, STANDS = 2e-3, 1e-2
"""A command that is farther than this from its motion [rad or m], as something holds it back, slows it down;
where it is as far as the second, the motion stands."""
HURRY = 0.05
"""The pace of the motion changes from rest to full in so much time at least [s]."""
STUCK, SLOWEST = 0.5, 0.05
"""A motion whose pace was below the second for so long is planned anew [s]. A guess."""
MAX_TRIES = 4
"""So many times at most."""
SAME = 1e-6
"""Places nearer to each other than this are one [rad or m]. A convention."""
BRAKES = 2.0
"""While joints that have failed brake, no way is looked for, so long in all at most [s]. A guess."""
RESTS, SETTLES = 1e-4, 0.3
"""A command so near to where it was to come to rest is there [rad or m]; held off, it is after so long
[s]. Conventions."""
PARTS_OF_BEND, WITHIN = 4, 1.001
"""What leads from braking into a motion takes as long as braking, or up to twice as long in so many steps,
and so much of a limit. A convention, and rounding of differences."""
PARTS_OF_BRAKING = 8
"""Whether the arm may brake so is asked of so many pieces of the motion. A convention."""
TOLERANCE = 1e-3
"""How near every joint of an arm in C comes to its goal [rad or m]."""


@jit
def _look_up(K: Any, W: Any, S: Any, t: float) -> None:
    """Where the motion is at a time [s]: that of the search between its places, or the straight one."""
    n, way = K.chain.n, S.ways
    if not W.plays:
        look_up(W, n, t)
        return
    table, last, period = places_of(S), way.ticks - 1, way.period
    i = min(int(t / period), last - 1)
    share = min(t / period - i, 1.0)
    for j in range(n):
        before, here = table[max(i - 1, 0), j], table[i, j]
        there, behind = table[i + 1, j], table[min(i + 2, last), j]
        v = (there - before) / (period if i == 0 else 2.0 * period)
        w = (behind - here) / (period if i + 1 == last else 2.0 * period)
        W.q_now[j], W.v_now[j], W.a_now[j] = here + share * (there - here), v + share * (w - v), 0.0


@jit
def _off(K: Any, W: Any) -> float:
    """How far the command is from where ``_look_up`` has the motion [rad or m]."""
    off = 0.0
    for i in range(K.chain.n):
        if W.moves[i]:
            off = max(off, abs(K.state.q_command[i] - W.q_now[i]))
    return off


@jit
def _write(K: Any, W: Any, J: Any, S: Any) -> None:
    """Let the tick follow the motion at the time that is asked for, which goes on at its pace."""
    n, dt = K.chain.n, K.state.dt
    _look_up(K, W, S, W.t)
    for i in range(n):
        if W.moves[i]:
            J.q[i], J.v[i] = W.q_now[i], W.rate * W.v_now[i]
    _look_up(K, W, S, W.t + W.rate * dt)
    for i in range(n):
        if W.moves[i]:
            change = W.rate * W.v_now[i] - J.v[i] if K.state.level == ACCELERATION else W.q_now[i] - J.q[i]
            J.x[i] = change / dt


@jit
def _is_left(K: Any, W: Any) -> bool:
    """Whether the command is not where the straight motion is."""
    look_up(W, K.chain.n, W.t)
    for i in range(K.chain.n):
        if W.moves[i] and (
            abs(K.state.q_command[i] - W.q_now[i]) > DEVIATION
            or abs(K.state.v_command[i] - W.v_now[i]) > W.slow[i]
        ):
            return True
    return False


@jit
def _begin_motion(K: Any, A: Any, W: Any, J: Any, copies: Any, goes: int, is_free: int) -> None:
    """Plan a motion from the last command, see ``plan_going``.

    Where what is around ``is_free`` as before, bodies may come as near as on the motion before.
    """
    write_together(copies)
    W.plays, W.rate, W.t = 0, 1.0, 0.0
    J.spared = J.spared if is_free else 0.0
    plan_going(K, A, W, goes)


@jit
def _play(K: Any, W: Any, J: Any, S: Any, t: float) -> None:
    """Play the motion that was found, from a time on [s]."""
    way = S.ways
    W.thinks, W.plays, W.rate, W.t, W.heavy = 0, 1, 1.0, t, -1
    J.spared = 1.0 - PROOF if way.is_free else 0.0
    for i in range(K.chain.n):
        W.moves[i] = K.faults.code[i] == HEALTHY
        if way.asks_pose:
            W.goal[i] = way.place[way.places - 1, i]


@rare_jit
def _take_places(K: Any, W: Any, way: Any) -> None:
    """The way through the places that are left: from the nearest on where some were gone.

    Joints that have failed stay where they are.
    """
    n, first, least = K.chain.n, 0, LARGE
    for k in range(way.asks_places if W.left > 1 else 0):
        far = 0.0
        for i in range(n):
            far = max(far, abs(way.given_place[k, i] - W.rest[i]))
        if far < least:
            first, least = k, far
    assign(way.place[0], W.rest, n)
    way.places = 1
    for k in range(first, way.asks_places):
        last, here, far = way.place[way.places - 1], way.place[way.places], 0.0
        for i in range(n):
            works = K.faults.code[i] == HEALTHY
            step = short_way(K, i, way.given_place[k, i] - last[i]) if works else 0.0
            here[i], far = last[i] + step, max(far, abs(step))
        way.places += 1 if far > SAME else 0
    round_off(way)


@rare_jit
def _free_until(K: Any, W: Any, S: Any) -> float:
    """Up to when the motion to rest is proven free [s], as far as that is known."""
    way, n = S.ways, K.chain.n
    for k in range(PARTS_OF_BRAKING + 1):
        t = W.duration * k / PARTS_OF_BRAKING
        look_up(W, n, t)
        assign(way.finish, W.q_now, n)
        for i in range(n):
            if K.faults.code[i] == BRAKING and W.v[i] != 0.0:
                rate, sign = K.faults.lock_rate[i], 1.0 if W.v[i] > 0.0 else -1.0
                s = min(t, abs(W.v[i]) / rate)
                way.finish[i] += W.v[i] * s - 0.5 * sign * rate * s * s
        if k > 0 and passes(S, way.begin, way.finish) < 1.0:
            return W.duration * (k - 1) / PARTS_OF_BRAKING
        assign(way.begin, way.finish, n)
    return float(W.duration)


@rare_jit
def _come_to_rest(K: Any, A: Any, W: Any, J: Any, S: Any, copies: Any, is_free: int) -> None:
    """Brake each joint soonest, or all together beside one that brakes; else as is free for longer."""
    goes, n = RESTS_SOONEST, K.chain.n
    for i in range(n):
        goes = RESTS_TOGETHER if K.faults.code[i] == BRAKING else goes
    _begin_motion(K, A, W, J, copies, goes, is_free)
    if W.duration == 0.0:
        return
    know_asked(S, K)
    know_surroundings(S, K.state.q_command)
    S.ways.share = 1.0 - J.spared
    until = _free_until(K, W, S)
    if until < W.duration:
        plan_going(K, A, W, RESTS_SOONEST + RESTS_TOGETHER - goes)
        if _free_until(K, W, S) <= until:
            plan_going(K, A, W, goes)


@rare_jit
def _turn_round(K: Any, A: Any, W: Any, J: Any, S: Any, copies: Any, is_free: int) -> None:
    """Come to rest, and look for a way from there; what is around ``is_free`` as it was proven."""
    way, n = S.ways, K.chain.n
    _come_to_rest(K, A, W, J, S, copies, is_free)
    for i in range(n):
        W.rest[i] = K.state.q_command[i] + (W.way[i] if W.moves[i] else 0.0)
    W.thinks = A_WAY
    begin_asked(S, K, W.rest, W.tries)
    for k in range(way.pairs if W.duration == 0.0 and is_free else 0):  # who begins too near is led away
        J.spared = max(J.spared, min(1.0 - way.allow[k] / way.keep, 1.0 - PROOF))
    if way.asks_pose:
        assign(W.goal, W.rest, n)
    elif way.asks_places:
        _take_places(K, W, way)
    else:
        for i in range(n):
            works = K.faults.code[i] == HEALTHY
            way.drawn[i] = W.rest[i] + (way_from(K, W, i, W.rest[i]) if works else 0.0)
        add_goal(S, way.drawn)


@rare_jit
def _plan(K: Any, A: Any, W: Any, J: Any, S: Any, copies: Any) -> None:
    """Plan from the command: straight, or to rest while a way is looked for."""
    W.left, W.thinks, W.scene = W.left + 1, 0, K.scene.version
    avoids = K.keeps.count > 0 or K.scene.pairs > 0
    seeks = W.asks == AS_ASKED or (W.asks == ROUND and avoids and W.left <= MAX_TRIES)
    if seeks and W.asks == AS_ASKED and S.ways.asks_pose and swings(K.faults, K.chain):
        W.blocked = NONE_FOUND
    if seeks and not W.blocked:
        _turn_round(K, A, W, J, S, copies, 1)
    else:
        _begin_motion(K, A, W, J, copies, GOES, 0)


@rare_jit
def _give_up(K: Any, A: Any, W: Any, J: Any, S: Any, copies: Any, why: int) -> None:
    """There is no way: go straight as near as it gets, where no pose was asked for nor a tube."""
    W.blocked, W.thinks = why, 0
    if W.asks == ROUND or S.ways.asks_places:
        _begin_motion(K, A, W, J, copies, GOES, 0)


@jit
def _bends(K: Any, W: Any, S: Any, first: int, count: int) -> bool:
    """Lead every joint from where ``look_up`` has it into the motion at a place, in so many periods.

    Whether that can be done within all limits.
    """
    table, dt = places_of(S), S.ways.period
    for i in range(K.chain.n):
        before, here, behind = table[first - 1, i], table[first, i], table[first + 1, i]
        v, a = (behind - before) / (2.0 * dt), (behind - 2.0 * here + before) / (dt * dt)
        if W.moves[i] and not between(
            W.bend_times[i], W.bend_jerks[i], here - W.q_now[i], W.v_now[i], W.a_now[i], v, a,
            S.ways.v_max[i], WITHIN * W.a_max[i], W.jerk[i], count * dt,
        ):  # fmt: skip
            return False
    return True


@rare_jit
def _joins(K: Any, W: Any, J: Any, S: Any, looks: int) -> bool:
    """Go over from braking into the motion that was found, without a rest, where that is proven free.

    It goes so far on into the motion as braking would still take. All that is kept is kept meanwhile: who
    comes near there was not slowed down for it, as on the motion itself.
    """
    way, n = S.ways, K.chain.n
    period, ticks, count = way.period, way.ticks, 0
    first = ceil((W.duration - W.t) / period)
    if not way.is_free or W.t < period or first < 1 or first >= ticks - 2:
        return False
    look_up(W, n, W.t)
    for part in range(PARTS_OF_BEND + 1):
        if count == 0 and _bends(K, W, S, first, first + first * part // PARTS_OF_BEND):
            count = first + first * part // PARTS_OF_BEND
    shift = count + 1 - first  # the place of the tick before comes first
    if count == 0 or (ticks + shift) * n > TABLE:
        return False
    way.ticks = ticks + shift
    table = places_of(S)
    for k in range(ticks - 1, first - 1, -1):
        assign(table[k + shift], table[k], n)
    for i in range(n):
        for k in range(count + 1):
            if W.moves[i]:
                times, jerks = W.bend_times[i], W.bend_jerks[i]
                gone = (
                    state_after(times, jerks, (k - 1) * period, W.v_now[i], W.a_now[i])[0] if k > 0 else 0.0
                )
                table[k, i] = W.q_now[i] + gone
            else:
                table[k, i] = table[count + 1, i]
    look_up(W, n, W.t - period)
    for i in range(n):
        table[0, i] = W.q_now[i] if W.moves[i] else table[0, i]
    way.ticks = count + 2
    prove_again(S, 1, 1.0)
    search_step(S, looks)
    is_free = way.stage == READY and way.is_free
    way.stage, way.again, way.is_free, way.ticks = READY, 0, 1, ticks
    if not is_free:
        sample(S)
        return False
    way.ticks = ticks + shift
    _play(K, W, J, S, period)
    return True


@rare_jit
def _look_round(K: Any, A: Any, W: Any, J: Any, S: Any, copies: Any, looks: int) -> None:
    """Think of the way for a tick, and play it where the arm rests at its begin, or sooner."""
    brakes, way, state = False, S.ways, K.state
    if W.scene != K.scene.version:
        W.scene = K.scene.version
        _turn_round(K, A, W, J, S, copies, 0)
        return
    for i in range(K.chain.n):
        brakes = brakes or (K.faults.code[i] != HEALTHY and state.v_command[i] != 0.0)
    if W.brakes > 0.0 and brakes:
        W.brakes, W.late = W.brakes - state.dt, 1
        return
    if W.late:
        W.late = 0
        _turn_round(K, A, W, J, S, copies, 1)
        return
    search_step(S, AT_ONCE * looks if W.t < W.duration else looks)
    if way.stage == NO_WAY:
        _give_up(K, A, W, J, S, copies, NONE_FOUND)
    elif way.stage == READY:
        off = 0.0
        for i in range(K.chain.n):
            off = max(off, abs(state.q_command[i] - W.rest[i]))
        _look_up(K, W, S, W.t)
        if _off(K, W) <= RESTS and _joins(K, W, J, S, looks):
            return
        if (W.t if off <= RESTS else W.t - SETTLES) < W.duration:
            return
        if off <= WAITS:
            _play(K, W, J, S, 0.0)
        elif W.tries >= MAX_TRIES:
            _give_up(K, A, W, J, S, copies, NO_REST)
        else:
            W.tries += 1
            _turn_round(K, A, W, J, S, copies, 1)


@rare_jit
def _prove_rest(K: Any, W: Any, S: Any, copies: Any) -> None:
    """What is around has changed: prove what is left of the motion anew."""
    way = S.ways
    write_together(copies)
    know_asked(S, K)
    know_surroundings(S, K.state.q_command)
    prove_again(S, min(int(W.t / way.period), way.ticks - 1), PROOF)
    W.thinks = A_PROOF


@rare_jit
def _think(K: Any, A: Any, W: Any, J: Any, S: Any, copies: Any, looks: int) -> None:
    """Think of a way, or prove what is left of the motion, for a tick."""
    way = S.ways
    if W.thinks == A_PROOF:
        search_step(S, looks)
        if way.stage == READY:
            W.thinks = 0
            if not way.is_free:
                _turn_round(K, A, W, J, S, copies, 0)
    elif W.thinks == A_WAY:
        _look_round(K, A, W, J, S, copies, looks)
    elif W.plays:
        W.scene = K.scene.version
        _prove_rest(K, W, S, copies)
    else:
        W.begun = -1
        _plan(K, A, W, J, S, copies)


@jit
def _pace(K: Any, A: Any, W: Any, J: Any, S: Any, copies: Any) -> None:
    """Let a motion that is played wait for an arm that is held back."""
    dt = K.state.dt
    _look_up(K, W, S, W.t)
    top = min(K.feedback.speed / W.speed, 1.0)
    wanted = min(max((STANDS - _off(K, W)) / (STANDS - WAITS), 0.0), top)
    W.rate = min(max(wanted, W.rate - dt / HURRY), W.rate + dt / HURRY)
    W.stood = W.stood + dt if W.rate < SLOWEST else 0.0
    if W.stood > STUCK and W.tries < MAX_TRIES:
        W.tries, W.stood = W.tries + 1, 0.0
        _turn_round(K, A, W, J, S, copies, 1)


@jit
def aim_going(K: Any, W: Any, asks: int) -> None:
    """Go to the goal from the next tick on."""
    W.asks, W.tries, W.left, W.brakes, W.late, W.ticks = asks, 0, 0, BRAKES, 0, K.state.ticks
    begin_anew(K, W)


@jit
def lead_going(K: Any, A: Any, W: Any, J: Any, S: Any, copies: Any) -> None:
    """Before a tick: plan or think where that is due, and lead the joints."""
    begins_anew(K, W)
    if W.begun != K.state.ticks or (W.speed != K.feedback.speed and not W.plays):
        W.speed = K.feedback.speed
        _plan(K, A, W, J, S, copies)
    elif W.thinks or (W.asks and not W.blocked and W.scene != K.scene.version):
        _think(K, A, W, J, S, copies, max(LEAST_LOOKS, int(LOOKS_A_SECOND * K.state.dt + 0.5)))
    if W.plays:
        _pace(K, A, W, J, S, copies)
    _write(K, W, J, S)


@jit
def is_on_way(W: Any, S: Any) -> bool:
    """Whether a way is looked for, or its motion is played and not over."""
    if W.plays:
        stuck = W.tries >= MAX_TRIES and W.stood > STUCK
        return not stuck and W.t < (S.ways.ticks - 1) * S.ways.period
    return bool(W.thinks or (W.asks == AS_ASKED and W.begun < 0 and not W.blocked))


@jit
def _is_at_pose(K: Any, S: Any) -> bool:
    """Whether the tip, as it is measured, is at the pose that was asked for."""
    way, place, turn = S.ways, S.ways.tolerance[0], S.ways.tolerance[1]
    pose_arm(S, K.feedback.seen)
    tip_error(S, way.goal)
    off, turned = squared(way, way.goal_rows, 0), squared(way, way.goal_rows, 3)
    return bool(off <= place * place and turned <= turn * turn)


@jit
def follow_going(K: Any, W: Any, S: Any, code: int) -> int:
    """After a tick: how the arm stands on its way, a ``Going``; RESTLESS once: it is to be stopped."""
    off = code in (STOPPING, STOPPED, INVALID_INPUT, HELD)
    W.t += W.rate * K.state.dt
    W.ticks = K.state.ticks
    W.begun = -1 if off or (not W.plays and _is_left(K, W)) else K.state.ticks
    if code in (STOPPING, STOPPED):
        W.state = GOING_HALTED
        return int(W.state)
    if W.state == GOING_HALTED:
        begin_anew(K, W)
    if W.state != GOING_MOVING or code == HELD:
        return int(W.state)
    if W.asks and is_on_way(W, S):
        wait_anew(W)
        return int(W.state)
    found = judge_going(K, W)
    if found == GOING_RESTLESS:
        return found
    W.state = found
    if found == GOING_REACHED and W.asks == AS_ASKED and S.ways.asks_pose:
        W.state = GOING_REACHED if not W.blocked and _is_at_pose(K, S) else GOING_UNREACHABLE
    return int(W.state)


@jit
def begin_as_given(K: Any, given: Any, W: Any, J: Any) -> None:
    """What is as ``GoTo`` has it by default."""
    bandwidth = min(BANDWIDTH, BANDWIDTH_STEPS / K.state.dt)
    accelerates = K.state.level == ACCELERATION
    J.kp, J.kv = (bandwidth * bandwidth, 2.0 * bandwidth) if accelerates else (bandwidth, 0.0)
    J.spared = 0.0
    for i in range(K.chain.n):
        W.counts[i] = 1
        W.least[i], W.jerk[i] = LEAST_ACCELERATION * given.a_max[i], ACCELERATION_SHARE * given.jerk[i]
    W.target[TARGET_HAS_ROTATION] = 1.0
    W.tolerance, W.whole = TOLERANCE, 1


@jit
def begin_going(K: Any, given: Any, W: Any, J: Any, S: Any, seeks: int, q: Any) -> None:
    """Go to a posture, (n,), from the next tick on: straight, or round what is kept."""
    begin_as_given(K, given, W, J)
    assign(W.goal, q, K.chain.n)
    aim_going(K, W, ROUND if seeks else STRAIGHT)
    if seeks:
        ask_as_given(S, K, given, S.ways.given_goal)
        S.ways.asks_pose = S.ways.asks_straight = 0


@jit
def begin_going_to_pose(K: Any, given: Any, W: Any, J: Any, S: Any, T: Any) -> int:
    """Go to a pose, (16,), from the next tick on: 0, or see ``cannot_seek``."""
    why = cannot_seek(K, given, T)
    if why:
        return why
    begin_as_given(K, given, W, J)
    ask_as_given(S, K, given, T)
    assign(W.goal, K.state.q_command, K.chain.n)
    aim_going(K, W, AS_ASKED)
    return 0
