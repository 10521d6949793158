"""The gate: what leaves a tick is finite, inside the range, and near what left the last one.

It is the last thing that a tick does, it looks at numbers alone, whatever made them, and it keeps for itself
what it has let through. Every tick begins at that, so that nothing between two ticks can move the reference.
Source: docs/theory/feedback.md, "The gate".
"""

from math import inf
from typing import Any

from ftqp.kernel.arm.kinematics import followers, forward_kinematics, mimic, mimic_places
from ftqp.kernel.feedback.observer import dynamics_at_estimate
from ftqp.kernel.feedback.reference import place_of
from ftqp.kernel.feedback.samples import ROOM, SIGMAS, SPEED_SHARE
from ftqp.kernel.jit import jit, part_jit, rare_jit
from ftqp.kernel.latches.settling import forget_settling
from ftqp.kernel.layout.enums import (
    ACCELERATION,
    AS_SENT,
    FALLBACK,
    FREE,
    HEALTHY,
    INVALID_INPUT,
    LOCKED,
    MEASURED,
    OK,
    POSITION_DRIVE,
    RELAXED,
    SCALED,
    STOPPING,
    TORQUE_DRIVE,
    VELOCITY,
    VELOCITY_DRIVE,
    VIABILITY,
)
from ftqp.kernel.layout.thresholds import FASTEST, LONGEST, ROUNDING, SCALED_FROM, UNLIMITED
from ftqp.kernel.maths.elementary import larger, smaller
from ftqp.kernel.maths.side_by_side import WIDTH, all_of, is_set, lane_mask, load_lanes, store_lanes
from ftqp.kernel.monitor.leading import keep_found
from ftqp.kernel.rows.failed_joints import braked_velocity

FARTHEST = ROUNDING * 2.0**52
"""Nothing turns or slides so far: of a place beyond, rounding alone is more than ``ROUNDING`` [rad or m]."""


@jit
def open_gate(state: Any, gate: Any, chain: Any) -> None:
    """Begin a tick at what was last let through."""
    for at in range(0, chain.n, WIDTH):
        store_lanes(state.q_command, at, load_lanes(gate.q, at))
        store_lanes(state.v_command, at, load_lanes(gate.v, at))


@jit
def _keeps(value: Any, most: Any) -> Any:
    """|value| <= most, rounding aside; never of what is no number."""
    return abs(value) <= most * (1.0 + ROUNDING) + ROUNDING


@jit
def _leaves_room(state: Any, v: Any, v_last: Any, a_max: Any, room: Any) -> Any:
    """Whether a joint that moves towards the end of its range can still stop, or brakes as hard as it can.

    At the velocity level a tick moves by the velocity at its end, so that whole ticks take v dt/2 less.
    """
    less = 0.5 * state.dt * v if state.level == VELOCITY else 0.0 * v
    stops = v * v <= 2.0 * a_max * (room + less + ROUNDING)
    return (v <= ROUNDING) | stops | (v <= v_last - SCALED_FROM * state.dt * a_max + ROUNDING)


@jit
def _near(state: Any, limits: Any, gate: Any, at: int, q: Any, v: Any, v_last: Any, v_max: Any) -> Any:
    """Whether (q, v) follows upon what was last let through: by way, speed, acceleration and range.

    A joint that is beyond its range comes back or brakes; one that is inside stays there.
    """
    dt = state.dt
    q_last, q_min, q_max = load_lanes(gate.q, at), load_lanes(limits.q_min, at), load_lanes(limits.q_max, at)
    near = _keeps(q - q_last, dt * larger(abs(v), abs(v_last)))
    near = near & _keeps(v, larger(smaller(v_max, UNLIMITED), abs(v_last)))
    if limits.conversion == VIABILITY:
        a_max = load_lanes(limits.a_max, at)
        near = near & _keeps(v - v_last, dt * a_max)
        near = near & (_leaves_room(state, v, v_last, a_max, q_max - q) | ((q_last > q_max) & (v < v_last)))
        return near & (_leaves_room(state, -v, -v_last, a_max, q - q_min) | ((q_last < q_min) & (v > v_last)))
    near = near & ((q <= q_max + ROUNDING) | ((q_last > q_max) & ((v <= ROUNDING) | (v < v_last))))
    return near & ((q >= q_min - ROUNDING) | ((q_last < q_min) & ((v >= -ROUNDING) | (v > v_last))))


@jit
def _is_a_motion(q: Any, v: Any, change: Any) -> Any:
    """Whether a joint can be at q, move at v and change that by so much in a tick, whatever it does."""
    return (abs(q) < FARTHEST) & (abs(v) < UNLIMITED) & (abs(change) < 2.0 * UNLIMITED)


@jit
def _lets_through(K: Any, at: int) -> bool:
    """Whether the commands of the joints from ``at`` on may leave: the reference, and what is made of it.

    Comparisons do not hold of what is no number. Of a joint that has failed, or of a body that floats, which
    nobody commands, no more is asked than that.
    """
    gate, state, feedback, limits = K.gate, K.state, K.feedback, K.limits
    q, v, v_last = load_lanes(state.q_command, at), load_lanes(state.v_command, at), load_lanes(gate.v, at)
    v_max, dt = load_lanes(limits.v_max, at), state.dt
    if feedback.active:
        near = _near(state, limits, gate, at, q, v, v_last, v_max)
        if feedback.kind == VELOCITY_DRIVE:
            near = near & _keeps(load_lanes(feedback.v_sent, at), larger(smaller(v_max, UNLIMITED), abs(v)))
        elif feedback.kind == TORQUE_DRIVE:
            tau = load_lanes(feedback.tau_sent, at)
            near = near & _keeps(tau, load_lanes(limits.tau_max, at)) & (abs(tau) < inf)
        elif feedback.kind == POSITION_DRIVE:
            top = larger(smaller(v_max, UNLIMITED), larger(abs(v), abs(v_last)))
            way = dt * (top + LONGEST * load_lanes(limits.a_max, at))
            near = near & _keeps(load_lanes(feedback.q_sent, at) - load_lanes(gate.sent, at), way)
            near = near & (abs(load_lanes(feedback.v_sent, at)) < inf)
    else:
        near = _keeps(v, larger(smaller(v_max, UNLIMITED), abs(v_last))) & (abs(q) < inf)
    if K.chain.mimics:
        near = near | followers(K.chain, at)
    if K.chain.floating:
        floats = lane_mask(K.chain.floating, at) & _is_a_motion(q, v, dt * load_lanes(state.a_command, at))
        near = near | floats
    if K.faults.working < K.chain.n:
        near = near | (is_set(K.faults.code, at) & _is_a_motion(q, v, dt * load_lanes(state.a_command, at)))
    return all_of(near | ~lane_mask(K.chain.n, at))


@jit
def _toward(last: Any, wanted: Any, most: Any) -> Any:
    """``wanted``, no farther than ``most`` from ``last``."""
    return smaller(larger(wanted, last - most), last + most)


@jit
def _send_to_failed(K: Any) -> None:
    """What joints that have failed are sent, beside where they are believed to be.

    A joint that is held goes on from what it was sent last, by no more than it takes to brake, and stays
    there: a sensor that is noisy or drifts moves the estimate, and with it what the others get, but
    not what is sent. Of a joint without motor and brake the estimate itself is said, as far as anything moves
    in a tick, be it beyond the range: there it begins when its motor works again.
    """
    gate, state, faults, feedback, dt = K.gate, K.state, K.faults, K.feedback, K.state.dt
    for k in range(faults.working, K.chain.n):
        i = faults.order[k]
        if faults.code[i] == FREE or faults.code[i] == MEASURED:
            feedback.q_sent[i] = _toward(gate.sent[i], state.q_command[i], 2.0 * FASTEST * dt)
            continue
        if K.monitor.names and keep_found(K, i):
            continue
        if feedback.lost[i] and K.monitor.on:  # nothing but what it was sent says where it is: its lead fades
            droop, v, q = K.monitor.droop[i], gate.v[i], gate.sent[i]
            if v != 0.0:
                q = state.q_command[i] + droop + (q - gate.q[i] - droop) * (state.v_command[i] / v)
            feedback.q_sent[i] = place_of(K.limits, gate, i, q)
            feedback.v_sent[i] = state.v_command[i]
            continue
        before = gate.speed[i]
        after = _toward(before, state.v_command[i], dt * K.limits.a_max[i])
        way = 0.5 * dt * (before + after) if state.level == ACCELERATION else dt * after
        feedback.q_sent[i] = place_of(K.limits, gate, i, gate.sent[i] + way)
        feedback.v_sent[i] = after


@rare_jit
def _send_as_measured(K: Any) -> bool:
    """Above a moving base commands begin at the samples: whether all went where they were to go.

    A sample that no joint can have reached since the last tick takes the command along only as far as the
    joint can go.
    """
    gate, state, feedback, limits = K.gate, K.state, K.feedback, K.limits
    whole = True
    for i in range(K.chain.n):
        if K.faults.code[i] != HEALTHY:
            continue
        top = max(min(limits.v_max[i], UNLIMITED), abs(state.v_command[i]))
        room = SPEED_SHARE * top * state.dt + SIGMAS * feedback.sigma + ROOM
        near = _toward(gate.sent[i], feedback.q_sent[i], room)
        whole = whole and near == feedback.q_sent[i]
        feedback.q_sent[i] = place_of(limits, gate, i, near)
    return whole


@rare_jit
def _brake(K: Any) -> None:
    """The command that was last let through, braked, in the place of this tick's; all else begins anew."""
    gate, state, feedback, faults, limits = K.gate, K.state, K.feedback, K.faults, K.limits
    n, dt = K.chain.n, state.dt
    for i in range(n):
        q, v = gate.q[i], gate.v[i]
        after = v
        if faults.code[i] == LOCKED:
            after = 0.0
        elif faults.code[i] != FREE and faults.code[i] != MEASURED:
            after = braked_velocity(v, limits.a_max[i], dt)
        way = 0.5 * dt * (v + after) if state.level == ACCELERATION else dt * after
        low, high = min(limits.q_min[i], q), max(limits.q_max[i], q)
        end = min(max(q + way, low), high)
        if end != q + way:
            after = 0.0
        state.q[i], state.v[i] = q, v
        state.q_command[i], state.v_command[i], state.a_command[i] = end, after, (after - v) / dt
        ahead = (gate.sent[i] - q) * (after / v) if v != 0.0 else 0.0  # of the lead
        sent = _toward(gate.sent[i], end + ahead, dt * max(abs(v), min(limits.v_max[i], UNLIMITED)))
        feedback.q_sent[i], feedback.v_sent[i] = place_of(limits, gate, i, sent), after
        K.task.slack[i % 6] = K.qp.z_box[i] = 0.0
        feedback.q_now[i], feedback.v_now[i] = q, v
    if K.chain.mimics:
        mimic_places(K.chain, state.q_command)
        mimic(K.chain, state.v_command)
        mimic(K.chain, state.a_command)
    K.kinematics.has_dynamics = 0
    if feedback.kind == TORQUE_DRIVE:
        dynamics_at_estimate(K)
        for i in range(n):
            tau = feedback.h[i]
            for j in range(n):
                tau += feedback.M[i, j] * state.a_command[j]
            tau = min(max(tau, -limits.tau_max[i]), limits.tau_max[i])
            tau = tau if abs(tau) < inf else gate.tau[i]
            feedback.tau_sent[i] = tau if faults.code[i] == HEALTHY else 0.0
    else:
        forward_kinematics(K, K.state)
    for j in range(len(K.qp.z)):
        K.qp.z[j] = 0.0
    K.task.scale = 0.0
    forget_settling(K.settling)
    K.settling.entered = 0
    K.qp.warm = 0
    K.free.joint = -1
    feedback.fresh = AS_SENT


@part_jit
def pass_gate(K: Any) -> bool:
    """Let the command through, or brake the last one in its place: whether it went through."""
    gate, state, feedback = K.gate, K.state, K.feedback
    through = True
    for at in range(0, K.chain.n, WIDTH):
        through = through and _lets_through(K, at)
    if not through:
        gate.shut += 1
        _brake(K)
        K.cascade.outcome = STOPPING if K.watch.latched else FALLBACK
    elif not feedback.active and not _send_as_measured(K):
        outcome = K.cascade.outcome
        if outcome == OK or outcome == RELAXED or outcome == SCALED:
            K.cascade.outcome = INVALID_INPUT
    _send_to_failed(K)
    if K.chain.mimics:
        mimic_places(K.chain, feedback.q_sent)
        mimic(K.chain, feedback.v_sent)
    for at in range(0, K.chain.n, WIDTH):
        store_lanes(gate.q, at, load_lanes(state.q_command, at))
        store_lanes(gate.v, at, load_lanes(state.v_command, at))
        store_lanes(gate.sent, at, load_lanes(feedback.q_sent, at))
        store_lanes(gate.speed, at, load_lanes(feedback.v_sent, at))
        if feedback.kind == TORQUE_DRIVE:
            store_lanes(gate.tau, at, load_lanes(feedback.tau_sent, at))
    for k in range(K.faults.working, K.chain.n):
        i = K.faults.order[k]
        if K.faults.code[i] == FREE or K.faults.code[i] == MEASURED:
            gate.speed[i] = 0.0  # nothing is sent that moves it
    return through
