"""What a caller hands to a tick, copied into the record and looked at: nothing of it is remembered."""

from math import atan2, inf, pi
from typing import Any

from ftqp.kernel.feedback.gate import open_gate
from ftqp.kernel.feedback.late_loop import miss
from ftqp.kernel.jit import jit, take
from ftqp.kernel.layout.enums import (
    NO_ROTATION,
    NOT_READ,
    NOT_RESET,
    TARGET_ACCELERATION,
    TARGET_HAS_ROTATION,
    TARGET_POSE,
    TARGET_SIZE,
    TARGET_TWIST,
    TWIST_ALONE,
    WRONG_SHAPE,
)
from ftqp.kernel.layout.thresholds import MOST_ROWS
from ftqp.kernel.maths.elementary import has_last_row, is_finite, is_rotation, whole_turns
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.maths.side_by_side import WIDTH, all_of, load_lanes, store_lanes


@jit
def accept_arrays(state: Any, gate: Any, chain: Any, q: Any, v: Any) -> int:
    """Copy q, (n,) or (nq,), and v, (n,): how many numbers q has, or a mistake (negative)."""
    nq = take(q, 0, state.given_q.ctypes.data, len(state.given_q), 1)
    nv = take(v, 0, state.given_v.ctypes.data, len(state.given_v), 1)
    if nq < 0 or nv < 0:
        return NOT_READ
    if (nq != chain.n and nq != chain.nq) or nv != chain.n:
        return WRONG_SHAPE
    if not state.is_reset:
        return NOT_RESET
    open_gate(state, gate, chain)
    return nq


@jit
def accept_target(task: Any, target: Any, row: int) -> int:
    """Copy row ``row`` of packed targets: 0, or a mistake (negative)."""
    if row < 0 or row > MOST_ROWS:
        return NOT_READ
    if take(target, row * TARGET_SIZE, task.target.ctypes.data, TARGET_SIZE, 0) < TARGET_SIZE:
        return NOT_READ
    return target_mistake(task)


@jit
def accept_numbers(K: Any, q: Any, v: Any, target: Any) -> int:
    """Copy the inputs of a tick that are plain memory, q and v (n,) and a packed target: 0, or a mistake."""
    state, n = K.state, K.chain.n
    if not state.is_reset:
        return NOT_RESET
    for i in range(n):
        state.given_q[i], state.given_v[i] = q[i], v[i]
    open_gate(state, K.gate, K.chain)
    for at in range(0, TARGET_SIZE, WIDTH):
        here = min(at, TARGET_SIZE - WIDTH)
        store_lanes(K.task.target, here, load_lanes(target, here))
    code = target_mistake(K.task)
    if code == 0:
        accept_state(state, K.chain, n)
    return code


@jit
def target_mistake(task: Any) -> int:
    """0, or why the target is none for this task (negative)."""
    if task.target[TARGET_HAS_ROTATION] <= 0.0:
        if task.target[TARGET_HAS_ROTATION] < 0.0:
            return TWIST_ALONE
        if task.uses_rotation:
            return NO_ROTATION
    return 0


@jit
def accept_state(state: Any, chain: Any, nq: int) -> None:
    """The given state as joint values: n of them, or nq with (cos, sin) for each continuous joint.

    The angle of a continuous joint, as it is or by cosine and sine, is unwrapped to the turn of the last
    command: an encoder may begin anew with every turn. Joints that mimic others are measured as any.
    """
    n, given = chain.n, state.given_q
    assign(state.v, state.given_v, n)
    if nq == n:
        for i in range(n):
            state.q[i] = given[i]
            if chain.continuous[i]:
                state.q[i] -= 2.0 * pi * whole_turns(given[i] - state.q_command[i])
        return
    k = 0
    for i in range(n):
        if chain.continuous[i]:
            angle = atan2(given[k + 1], given[k]) - state.q_command[i]
            state.q[i] = state.q_command[i] + angle - 2.0 * pi * whole_turns(angle)
            if not (is_finite(given[k]) and is_finite(given[k + 1])):
                state.q[i] = given[k] + given[k + 1]
            k += 2
        else:
            state.q[i] = given[k]
            k += 1


@jit
def target_is_usable(task: Any) -> bool:
    """Whether the target is finite and its pose, if it has one, is one: its rotation and its last row.

    |x| < inf of each: fast math may fold a sum of x - x into zero, NaN or not.
    """
    target = task.target
    good = True
    for at in range(0, TARGET_HAS_ROTATION, WIDTH):
        here = load_lanes(target, min(at, TARGET_HAS_ROTATION - WIDTH))
        good = good and all_of(abs(here) < inf)
    if good and task.target[TARGET_HAS_ROTATION] > 0.0:
        return has_last_row(target[12], target[13], target[14], target[15]) and is_rotation(target)
    return good


@jit
def state_is_finite(state: Any, chain: Any) -> bool:
    """Whether the measured state is finite; a q or v that is not gives way to the last command."""
    good = state.unusable == 0
    for at in range(0, chain.n, WIDTH):
        finite = (abs(load_lanes(state.q, at)) < inf) & (abs(load_lanes(state.v, at)) < inf)
        good = good and all_of(finite)
    if not good:
        for i in range(chain.n):
            state.q[i] = state.q_command[i]
            state.v[i] = state.v_command[i]
    return good


@jit
def miss_tick(K: Any, target: Any, row: int, left: int, q: Any, later: Any, out: Any) -> int:
    """The next tick is one that a late loop has missed: 0 and what it is given (q, out), or a mistake."""
    if row < 0 or row > MOST_ROWS:
        return NOT_READ
    if take(target, row * TARGET_SIZE, later.ctypes.data, TARGET_SIZE, 0) < TARGET_SIZE:
        return NOT_READ
    miss(K, later, left, q, out)
    return 0


@jit
def write_target(target_at: int, pose: Any, twist: Any, acceleration: Any) -> int:
    """Pose, twist and acceleration into a packed target: 0, or a mistake, and then nothing is written."""
    pose_at, twist_at = target_at + 8 * TARGET_POSE, target_at + 8 * TARGET_TWIST
    acceleration_at = target_at + 8 * TARGET_ACCELERATION
    for copied in range(2):  # how many there are, before any is copied
        if (
            take(pose, 0, pose_at, 16 * copied, 2) != 16
            or take(twist, 0, twist_at, 6 * copied, 1) != 6
            or take(acceleration, 0, acceleration_at, 6 * copied, 1) != 6
        ):
            return NOT_READ
    return 0
