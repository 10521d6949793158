"""An arm moves from its own record into a lane, and back."""

from typing import Any

from ftqp.kernel.jit import jit, lane_of, put_lane
from ftqp.kernel.layout.enums import (
    AS_TOLD,
    BRAKING,
    HARD,
    HEALTHY,
    LOCKED,
    MAIN_STAGE,
    OK,
    RELAXED,
    SLACK,
    VIABILITY,
)

NOT_SEEN = -1.0
"""Smallest singular value of an arm that has not been looked at since its joints failed."""


@jit
def have_lanes(K: Any) -> bool:
    """Whether the ticks of such a planner may be common ones at all."""
    criteria, task = K.criteria, K.task
    return bool(
        not criteria.apart
        and criteria.norm > 0.0
        and (task.mode == SLACK or task.mode == HARD)
        and task.m > 0
        and K.turned.factor == 0.0
        and K.limits.conversion == VIABILITY
        and task.given_up == 0
        and (K.chain.has_inertia or not K.limits.dynamic)
    )


@jit
def may_move_in(K: Any, code: int) -> bool:
    """Whether the arm's next tick is likely to be a common one: nothing of the last one needs to be known."""
    faults, feedback = K.faults, K.feedback
    if (
        (code != OK and code != RELAXED)
        or K.cascade.stage != MAIN_STAGE
        or K.qp.warm != 0
        or K.watch.latched != 0
    ):
        return False
    if K.calm.entered or K.calm.holding or K.calm.hushed or faults.movable != faults.working:
        return False
    if feedback.lagging or feedback.late != 0.0 or feedback.rate != 1.0 or feedback.speed_margin != 0.0:
        return False
    for i in range(K.chain.n):
        if faults.code[i] != HEALTHY and faults.code[i] != LOCKED and faults.code[i] != BRAKING:
            return False
    return True


@jit
def move_in(K: Any, L: Any, l: int) -> None:
    """Copy what a lane needs to know of an arm into lane l."""
    state, limits, calm, n = K.state, K.limits, K.calm, K.chain.n
    moving = 0.0
    for i in range(n):
        brakes = K.faults.code[i] == BRAKING
        put_lane(L.faults.lock_velocity, i, l, K.faults.lock_velocity[i] if brakes else 0.0)
        put_lane(L.faults.lock_rate, i, l, K.faults.lock_rate[i] if brakes else 1.0)
        put_lane(L.lane.fixed, i, l, 0.0)
        put_lane(L.lane.after, i, l, 0.0)
        if brakes:
            moving = 1.0
        put_lane(L.state.q, i, l, state.q_command[i])
        put_lane(L.state.v, i, l, state.v_command[i])
        put_lane(L.lane.a_last, i, l, state.a_command[i])
        put_lane(L.faults.works, i, l, 1.0 if K.faults.code[i] == HEALTHY else 0.0)
        put_lane(L.limits.q_min, i, l, limits.q_min[i])
        put_lane(L.limits.q_max, i, l, limits.q_max[i])
        put_lane(L.limits.v_max, i, l, limits.v_max[i])
        put_lane(L.limits.a_max, i, l, limits.a_max[i])
        put_lane(L.limits.a_brake, i, l, limits.a_brake[i])
        put_lane(L.limits.tau_max, i, l, limits.tau_max[i])
        put_lane(L.calm.q_seen, i, l, calm.q_seen[i])
    put_lane(L.lane.braking, 0, l, moving)
    put_lane(L.limits.guard, 0, l, limits.guard)
    seen = calm.sigma_seen if calm.seen_working == K.faults.working else NOT_SEEN
    put_lane(L.calm.sigma_seen, 0, l, seen)
    put_lane(L.calm.stood, 0, l, calm.stood)
    put_lane(L.watch.last_position_error, 0, l, K.watch.last_position_error)
    put_lane(L.watch.last_rotation_error, 0, l, K.watch.last_rotation_error)


@jit
def move_out(K: Any, L: Any, l: int, S: Any, tick: int) -> None:
    """Copy what lane l has become into the arm's own record, as it stands before a tick.

    Args:
        K: the record, which has been that of the arm before.
        L: the lanes.
        l: the lane.
        S: the record that the lanes share, which has seen every target before this tick's.
        tick: the number of the tick that comes.
    """
    state, calm = K.state, K.calm
    for i in range(K.chain.n):
        K.gate.q[i] = K.gate.sent[i] = state.q_command[i] = lane_of(L.state.q, i, l)
        K.gate.v[i] = state.v_command[i] = lane_of(L.state.v, i, l)
        state.a_command[i] = lane_of(L.lane.a_last, i, l)
        if K.faults.code[i] == BRAKING:
            K.faults.lock_velocity[i] = lane_of(L.faults.lock_velocity, i, l)
    state.ticks = tick
    K.feedback.fresh = AS_TOLD
    calm.stood, calm.sure, calm.window = lane_of(L.calm.stood, 0, l), 0.0, 0.0
    for k in range(12):
        calm.anchor[k] = S.calm.anchor[k]
    K.watch.last_position_error = lane_of(L.watch.last_position_error, 0, l)
    K.watch.last_rotation_error = lane_of(L.watch.last_rotation_error, 0, l)
    K.watch.rising = K.watch.fallbacks = 0
