"""Many arms through one trajectory in closed loop, several side by side, without Python inside."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ftqp.kernel.calm.rest import target_stands
from ftqp.kernel.calm.trigger import measure_arm
from ftqp.kernel.free.end_stop import stop_torques
from ftqp.kernel.jit import COMPILED, as_mask, bits, carray, jit, lane_of, lane_record, pointer
from ftqp.kernel.judge.fallback_cascade import run_cascade
from ftqp.kernel.lanes.common_tick import common_tick, settle
from ftqp.kernel.lanes.moving_over import have_lanes, may_move_in, move_in, move_out
from ftqp.kernel.layout.enums import AS_TOLD, FREE, INVALID_INPUT, OK, RELAXED, SOLVED, TARGET_SIZE, Status
from ftqp.kernel.layout.free_memory import free_dtype
from ftqp.kernel.layout.lane_rooms import lanes_dtype
from ftqp.kernel.layout.record import belief_dtype, record_dtype
from ftqp.kernel.maths.finite import is_finite
from ftqp.kernel.rows.turned_rows import turn_back
from ftqp.kernel.ticks.accepted_inputs import accept_state, target_is_usable
from ftqp.kernel.ticks.steps import FLOAT
from ftqp.kernel.ticks.tick import prepare_free, prepare_plain, prepare_rich

WHOLE = np.dtype(np.int64)
STATUSES = len(Status)
AWAY, INSIDE, ABSENT = 0, 1, 2
"""Where an arm is: in its own record, in a lane, or nowhere, as its start is no number."""
FILLED = ("kinematics", "chain", "qp", "scratch", "turned", "past", "history", "aside")
"""The rooms that need not be copied for the next arm of the same planner: constants, and memory of a tick."""
NEXT, PLACE = 0, 1
"""What is known of each arm of a group: its next event, and where it is."""


@jit
def believe_event(K: Any, B: Any, joint: int) -> None:
    """From now on the arm believes what record B believes of its limits and of a joint."""
    limits, other = K.limits, B.limits
    for i in range(K.chain.n):
        limits.q_min[i], limits.q_max[i] = other.q_min[i], other.q_max[i]
        limits.v_max[i], limits.a_max[i] = other.v_max[i], other.a_max[i]
        limits.a_brake[i], limits.tau_max[i] = other.a_brake[i], other.tau_max[i]
    limits.dynamic, limits.on_demand, limits.guard = other.dynamic, other.on_demand, other.guard
    faults, theirs = K.faults, B.faults
    faults.reset_mode = theirs.reset_mode
    faults.code[joint], faults.lock_rate[joint] = theirs.code[joint], theirs.lock_rate[joint]
    faults.lock_velocity[joint] = theirs.lock_velocity[joint]
    faults.friction[joint], faults.coulomb[joint] = theirs.friction[joint], theirs.coulomb[joint]
    K.qp.warm = 0
    if faults.code[joint] == FREE:
        K.free.joint = -1


@jit
def _accept(K: Any, target: Any) -> None:
    """The arm is where it was told to be."""
    state = K.state
    n = K.chain.n
    for i in range(n):
        state.given_q[i], state.given_v[i] = state.q_command[i], state.v_command[i]
    for i in range(TARGET_SIZE):
        K.task.target[i] = target[i]
    accept_state(K, n)


@jit
def tick_alone(K: Any, target: Any) -> int:
    """A tick of the arm in its own record, which it follows exactly."""
    _accept(K, target)
    return run_cascade(K, prepare_plain(K), SOLVED)


@jit
def any_tick_alone(K: Any, F: Any, target: Any) -> int:
    """The same, whatever terms the planner has and also where a joint swings freely."""
    _accept(K, target)
    if _frees(K):
        code = run_cascade(K, prepare_free(K, F), SOLVED)
        stop_torques(K)
    else:
        code = run_cascade(K, prepare_rich(K), SOLVED)
    if K.turned.on:
        turn_back(K)
    return code


@jit
def _frees(K: Any) -> bool:
    """Whether a joint swings freely."""
    for i in range(K.chain.n):
        if K.faults.code[i] == FREE:
            return True
    return False


@jit
def _begin(K: Any, q: Any, v: Any) -> bool:
    """Put an arm on its start; whether that is one."""
    good = True
    for i in range(K.chain.n):
        K.gate.q[i] = K.gate.sent[i] = K.state.q_command[i] = q[i]
        K.gate.v[i] = K.state.v_command[i] = v[i]
        good = good and is_finite(q[i]) and is_finite(v[i])
    K.feedback.fresh = AS_TOLD
    return good


@jit
def _see(K: Any, worst: Any) -> None:
    """Keep the largest errors."""
    worst[0] = max(worst[0], K.task.position_error)
    worst[1] = max(worst[1], K.task.rotation_error)


@jit
def _count(counts: Any, first_bad: Any, r: int, code: int, tick: int) -> None:
    """Count a tick of arm r by its status."""
    counts[code] += 1
    if code != OK and first_bad[r] < 0:
        first_bad[r] = tick


@jit
def _given(arms: int, n: int, ticks: int, q_at: int, v_at: int, targets_at: int) -> Any:
    """q and v of every arm, and the targets."""
    q, v = carray(pointer(q_at), (arms, n), FLOAT), carray(pointer(v_at), (arms, n), FLOAT)
    return q, v, carray(pointer(targets_at), (ticks, TARGET_SIZE), FLOAT)


@jit
def _told(arms: int, starts_at: int, events_at: int) -> Any:
    """Where the events of each arm begin, and the events."""
    starts = carray(pointer(starts_at), (arms + 1,), WHOLE)
    return starts, carray(pointer(events_at), (starts[arms], 3), WHOLE)


@jit
def _found(arms: int, n: int, kept: int, worst_at: int, counts_at: int, bad_at: int, trace_at: int) -> Any:
    """Largest errors, ticks per status, first bad ticks and kept q of every arm."""
    worst = carray(pointer(worst_at), (arms, 2), FLOAT)
    counts = carray(pointer(counts_at), (arms, STATUSES), WHOLE)
    first_bad = carray(pointer(bad_at), (arms,), WHOLE)
    return worst, counts, first_bad, carray(pointer(trace_at), (arms, kept, n), FLOAT)


def _worked_in(capacity: int) -> tuple[int, int]:
    """The words of a record from ``begin`` to ``end`` that every tick fills anew, or that are constants.

    Raises:
        ValueError: The rooms lie in another order, so that something else is there.
    """
    dtype = record_dtype(capacity)
    names = [str(name) for name in dtype.names or ()]
    first, last = names.index(FILLED[0]), names.index(FILLED[-1])
    if tuple(names[first : last + 1]) != FILLED:
        raise ValueError(f"the rooms {FILLED} of a record are not side by side")
    fields: Any = dtype.fields
    return fields[FILLED[0]][1] // 8, fields[names[last + 1]][1] // 8


def _rollout(capacity: int, width: int) -> Callable[..., int]:
    """Arms ``first`` to ``last - 1`` in groups of ``width``, each with a start and faults of its own."""
    dtype = record_dtype(capacity)
    words = dtype.itemsize // 8
    beliefs_are = belief_dtype(capacity)
    begin, end = _worked_in(capacity)
    lanes_at = lane_record(width, lanes_dtype(capacity, width))

    def rollout(
        model_at: int,
        own_at: int,
        lanes: int,
        work_at: int,
        first: int,
        last: int,
        ticks: int,
        q_at: int,
        v_at: int,
        targets_at: int,
        beliefs_at: int,
        believed: int,
        events_at: int,
        starts_at: int,
        worst_at: int,
        counts_at: int,
        first_bad_at: int,
        trace_at: int,
        every: int,
        stop_at: int,
    ) -> int:
        """How many arms were driven to the end; fewer than there are when the stop flag was set.

        The record at ``model_at`` is what every arm begins with. ``own_at``: ``width`` + 1 records that are
        worked in, the last one shared; ``lanes``: lane memory; ``work_at``: (width, 2). q and v are (B, n),
        the final state on return; targets (ticks, 29); events (E, 3) tick, index of what is then believed,
        joint, those of arm r from ``starts[r]`` to ``starts[r + 1]``, by tick; worst (B, 2) largest position
        [m] and rotation error [rad]; counts (B, number of statuses) ticks per status; first_bad
        (B,) the first tick that was not OK, given as -1; trace
        (B, ticks // every, n) q after every so many ticks, none where ``every`` is 0.
        """
        own = carray(pointer(own_at), width + 1, dtype)
        beliefs = carray(pointer(beliefs_at), believed, beliefs_are)
        model = carray(pointer(model_at), (words,), WHOLE)
        copies = carray(pointer(own_at), (width + 1, words), WHOLE)
        S = own[width]
        L = lanes_at(lanes, S)
        work, stop = carray(pointer(work_at), (width, 2), WHOLE), carray(pointer(stop_at), 1, WHOLE)
        n = carray(pointer(model_at), 1, dtype)[0].chain.n
        kept = ticks // every if every > 0 else 0
        q, v, targets = _given(last, n, ticks, q_at, v_at, targets_at)
        starts, events = _told(last, starts_at, events_at)
        worst, counts, first_bad, trace = _found(last, n, kept, worst_at, counts_at, first_bad_at, trace_at)
        for base in range(first, last, width):
            count = min(width, last - base)
            for w in range(words):
                copies[width, w] = model[w]
            common = COMPILED and have_lanes(S)
            measure_arm(S)
            for i in range(6):
                S.feedback.push[i] = 0.0  # what the planner's own arm was displaced by
            inside = 0
            if common:
                L.lane.worst[0], L.lane.worst[1] = 0.0, 0.0
                L.lane.done[0], L.lane.relaxed[0] = 0.0, 0.0
                L.lane.first_bad[0] = -1.0
            for l in range(count):
                r = base + l
                work[l, NEXT], work[l, PLACE] = starts[r], AWAY
                for w in range(words if base == first else begin):
                    copies[l, w] = model[w]
                for w in range(end, words):
                    copies[l, w] = model[w]
                own[l].qp.warm = 0
                if not _begin(own[l], q[r], v[r]):
                    work[l, PLACE] = ABSENT
            for k in range(ticks):
                if stop[0] != 0:
                    return base - first
                for i in range(TARGET_SIZE):
                    S.task.target[i] = targets[k, i]
                for l in range(count):
                    at, r = work[l, NEXT], base + l
                    while at < starts[r + 1] and events[at, 0] <= k:
                        if work[l, PLACE] == INSIDE:
                            move_out(own[l], L, l, S, k)
                            work[l, PLACE], inside = AWAY, inside & ~(1 << l)
                        believe_event(own[l], beliefs[events[at, 1]], events[at, 2])
                        at += 1
                    work[l, NEXT] = at
                stay = 0
                if inside != 0 and target_is_usable(S):
                    stay = bits(common_tick(L, as_mask(L, inside)))
                if stay != (1 << count) - 1:
                    for l in range(count):
                        if (stay >> l) & 1:
                            continue
                        r, K = base + l, own[l]
                        if work[l, PLACE] == ABSENT:
                            _count(counts[r], first_bad, r, INVALID_INPUT, k)
                            continue
                        if work[l, PLACE] == INSIDE:
                            move_out(K, L, l, S, k)
                        code = tick_alone(K, S.task.target)
                        _see(K, worst[r])
                        _count(counts[r], first_bad, r, code, k)
                        if common and may_move_in(K, code):
                            move_in(K, L, l)
                            work[l, PLACE], inside = INSIDE, inside | (1 << l)
                        else:
                            work[l, PLACE], inside = AWAY, inside & ~(1 << l)
                stands = 1.0 if target_stands(S) else 0.0
                if stay != 0:
                    settle(L, as_mask(L, stay), stands, k)
                if kept > 0 and (k + 1) % every == 0 and k // every < kept:
                    for l in range(count):
                        for i in range(n):
                            where = work[l, PLACE]
                            trace[base + l, k // every, i] = (
                                lane_of(L.state.q, i, l)
                                if where == INSIDE
                                else (own[l].state.q_command[i] if where == AWAY else q[base + l, i])
                            )
            for l in range(count):
                r, K = base + l, own[l]
                for i in range(n):
                    if work[l, PLACE] == INSIDE:
                        q[r, i], v[r, i] = lane_of(L.state.q, i, l), lane_of(L.state.v, i, l)
                    elif work[l, PLACE] == AWAY:
                        q[r, i], v[r, i] = K.state.q_command[i], K.state.v_command[i]
                if common:
                    for e in range(2):
                        worst[r, e] = max(worst[r, e], lane_of(L.lane.worst, e, l))
                    relaxed = int(lane_of(L.lane.relaxed, 0, l))
                    counts[r, OK] += int(lane_of(L.lane.done, 0, l)) - relaxed
                    counts[r, RELAXED] += relaxed
                    bad = int(lane_of(L.lane.first_bad, 0, l))
                    if bad >= 0 and (first_bad[r] < 0 or bad < first_bad[r]):
                        first_bad[r] = bad
        return last - first

    rollout.__name__ = f"rollout_{width}"
    return rollout


def rollout_any(capacity: int) -> Callable[..., int]:
    """Arms one after the other, with directional damping, gradients, and joints that swing freely."""
    dtype, beliefs_are = record_dtype(capacity), belief_dtype(capacity)
    words = dtype.itemsize // 8
    free = free_dtype(capacity)

    def rollout_any(
        model_at: int,
        own_at: int,
        free_at: int,
        first: int,
        last: int,
        ticks: int,
        q_at: int,
        v_at: int,
        targets_at: int,
        beliefs_at: int,
        believed: int,
        events_at: int,
        starts_at: int,
        worst_at: int,
        counts_at: int,
        first_bad_at: int,
        trace_at: int,
        every: int,
        stop_at: int,
    ) -> int:
        """As ``rollout``; ``own_at``: one record that is worked in, ``free_at``: memory for a free joint."""
        model, own = carray(pointer(model_at), (words,), WHOLE), carray(pointer(own_at), (words,), WHOLE)
        beliefs = carray(pointer(beliefs_at), believed, beliefs_are)
        K, F = carray(pointer(own_at), 1, dtype)[0], carray(pointer(free_at), 1, free)[0]
        stop = carray(pointer(stop_at), 1, WHOLE)
        n = carray(pointer(model_at), 1, dtype)[0].chain.n
        kept = ticks // every if every > 0 else 0
        q, v, targets = _given(last, n, ticks, q_at, v_at, targets_at)
        starts, events = _told(last, starts_at, events_at)
        worst, counts, first_bad, trace = _found(last, n, kept, worst_at, counts_at, first_bad_at, trace_at)
        for r in range(first, last):
            for w in range(words):
                own[w] = model[w]
            at, present = starts[r], _begin(K, q[r], v[r])
            for k in range(ticks):
                if stop[0] != 0:
                    return r - first
                while at < starts[r + 1] and events[at, 0] <= k:
                    believe_event(K, beliefs[events[at, 1]], events[at, 2])
                    at += 1
                code = INVALID_INPUT
                if present:
                    code = any_tick_alone(K, F, targets[k])
                    _see(K, worst[r])
                _count(counts[r], first_bad, r, code, k)
                if kept > 0 and (k + 1) % every == 0 and k // every < kept:
                    for i in range(n):
                        trace[r, k // every, i] = K.state.q_command[i]
            for i in range(n):
                q[r, i], v[r, i] = K.state.q_command[i], K.state.v_command[i]
        return last - first

    return rollout_any


def rollout_4(capacity: int) -> Callable[..., int]:
    """Groups of four arms: AVX2, NEON, and whatever a wheel was made for."""
    return _rollout(capacity, 4)


def rollout_8(capacity: int) -> Callable[..., int]:
    """Groups of eight arms: AVX-512."""
    return _rollout(capacity, 8)
