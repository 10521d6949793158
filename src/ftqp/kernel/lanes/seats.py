"""An arm whose common ticks are done elsewhere: it moves from its own record to a seat, and back."""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import AS_TOLD, BRAKING, HEALTHY, INSTANT, LOCKED


@jit
def take_seat(K: Any, seat: Any, tick: int, until: int) -> None:
    """Write what the common ticks need to know of the arm.

    Args:
        K: the record.
        seat: of ``ftqp.kernel.layout.lane_rooms.seats_dtype``.
        tick: that comes next.
        until: tick of the arm's next fault.
    """
    state, limits, faults = K.state, K.limits, K.faults
    seat.tick, seat.until = tick, until
    for i in range(K.chain.n):
        brakes = faults.code[i] == BRAKING
        seat.q[i], seat.v[i], seat.a_last[i] = state.q_command[i], state.v_command[i], state.a_command[i]
        seat.works[i] = 1.0 if faults.code[i] == HEALTHY else 0.0
        seat.lock_velocity[i] = faults.lock_velocity[i] if brakes else 0.0
        seat.lock_rate[i] = faults.lock_rate[i] if brakes else 1.0
        seat.q_min[i], seat.q_max[i] = limits.q_min[i], limits.q_max[i]
        seat.v_max[i], seat.a_max[i] = limits.v_max[i], limits.a_max[i]
        seat.a_brake[i], seat.tau_max[i] = limits.a_brake[i], limits.tau_max[i]
    seat.guard, seat.stood = limits.guard, K.calm.stood
    for k in range(12):
        seat.anchor[k] = K.calm.anchor[k]
    seat.last_position_error = K.watch.last_position_error
    seat.last_rotation_error = K.watch.last_rotation_error


@jit
def leave_seat(K: Any, seat: Any) -> None:
    """The record of an arm as it stands before the seat's tick.

    Args:
        K: a record as after a reset, which believes what the arm was told before that tick.
        seat: what the common ticks have made of the arm.
    """
    state, faults, calm, watch = K.state, K.faults, K.calm, K.watch
    count = 0
    for i in range(K.chain.n):
        K.gate.q[i] = K.gate.sent[i] = state.q_command[i] = seat.q[i]
        K.gate.v[i] = state.v_command[i] = seat.v[i]
        state.a_command[i] = seat.a_last[i]
        if faults.code[i] == INSTANT:
            faults.code[i] = LOCKED
        if faults.code[i] == BRAKING:
            faults.lock_velocity[i] = seat.lock_velocity[i]
        if faults.code[i] == HEALTHY:
            calm.known[count] = i
            count += 1
    calm.known_working = count
    calm.stood, calm.sure, calm.window = seat.stood, 0.0, 0.0
    for k in range(12):
        calm.anchor[k] = seat.anchor[k]
    state.ticks = seat.tick
    K.feedback.fresh = AS_TOLD
    watch.last_position_error = seat.last_position_error
    watch.last_rotation_error = seat.last_rotation_error
    watch.rising = watch.fallbacks = 0
