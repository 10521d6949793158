"""Many arms through one trajectory in closed loop, one after the other, without Python inside."""

from typing import Any

import numpy as np

from ftqp.kernel.commands.believed import falls, look_again
from ftqp.kernel.free.end_stop import stop_torques
from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.judge.fallback_cascade import run_cascade
from ftqp.kernel.layout.enums import AS_STATED, FREE, INVALID_INPUT, MEASURED, OK, SOLVED, TARGET_SIZE, Status
from ftqp.kernel.layout.record import dtype
from ftqp.kernel.maths.elementary import is_finite
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.rows.task_rows import turn_back
from ftqp.kernel.ticks.accepted_inputs import accept_state
from ftqp.kernel.ticks.steps import FLOAT
from ftqp.kernel.ticks.tick import prepare_free, prepare_rich

WHOLE = np.dtype(np.int64)
BELIEF = dtype("belief")
STATUSES = len(Status)


@jit
def believe_event(faults: Any, limits: Any, chain: Any, qp: Any, free: Any, B: Any, joint: int) -> None:
    """From now on the arm believes what record B believes of its limits and of a joint."""
    other = B.limits
    for i in range(chain.n):
        limits.q_min[i], limits.q_max[i] = other.q_min[i], other.q_max[i]
        limits.v_max[i], limits.a_max[i] = other.v_max[i], other.a_max[i]
        limits.a_brake[i], limits.tau_max[i] = other.a_brake[i], other.tau_max[i]
        limits.tau_hold[i] = other.tau_hold[i]
    limits.dynamic, limits.on_demand, limits.guard = other.dynamic, other.on_demand, other.guard
    limits.weakened = other.weakened
    theirs = B.faults
    faults.reset_mode = theirs.reset_mode
    faults.code[joint], faults.lock_rate[joint] = theirs.code[joint], theirs.lock_rate[joint]
    faults.lock_velocity[joint] = theirs.lock_velocity[joint]
    faults.friction[joint], faults.coulomb[joint] = theirs.friction[joint], theirs.coulomb[joint]
    qp.warm = 0
    if faults.code[joint] == MEASURED:
        faults.code[joint] = FREE  # nobody measures: it swings as its dynamics say
    if faults.code[joint] == FREE:
        free.joint = -1


@jit
def _tick(K: Any, F: Any, target: Any) -> int:
    """A tick of the arm, which is where it was sent."""
    state = K.state
    n = K.chain.n
    for i in range(n):
        state.given_q[i], state.given_v[i] = state.q_command[i], state.v_command[i]
    assign(K.task.target, target, TARGET_SIZE)
    accept_state(state, K.chain, n)
    if falls(K.faults, K.chain):
        code = run_cascade(K, prepare_free(K, F), SOLVED)
        stop_torques(state, K.faults, K.kinematics, K.chain, K.free)
    else:
        code = run_cascade(K, prepare_rich(K), SOLVED)
    if K.turned.on:
        turn_back(K.task, K.scratch, K.turned)
    return code


@jit
def _begin(
    state: Any, criteria: Any, feedback: Any, gate: Any, chain: Any, q: Any, v: Any, returns: int
) -> bool:
    """Put an arm on its start; whether that is one."""
    good = True
    for i in range(chain.n):
        gate.q[i] = gate.sent[i] = state.q_command[i] = q[i]
        gate.v[i] = gate.speed[i] = state.v_command[i] = v[i]
        if returns:
            criteria.posture[i] = q[i]
        good = good and is_finite(q[i]) and is_finite(v[i])
    feedback.fresh = AS_STATED
    return good


@jit
def copy_words(of: Any, used: Any, to: Any) -> None:
    """Copy runs of words, (k, 2) of their begins and ends."""
    for k in range(len(used)):
        for w in range(used[k, 0], used[k, 1]):
            to[w] = of[w]


@jit
def rollout(model: Any, used: Any, B: Any, own: Any, K: Any, F: Any, n: int, first: int, last: int) -> int:
    """How many of the arms ``first`` to ``last - 1`` were driven to the end; fewer when asked to stop.

    The words ``used`` of ``model`` are what every arm, of n joints, begins with; what it becomes is worked
    in those of ``own``, which are K, and in F while a joint swings freely. Arms that are skipped are neither
    touched nor counted.
    """
    arms, ticks = B.arms, B.ticks
    kept = ticks // B.every if B.every > 0 else 0
    q, v = carray(pointer(B.q_at), (arms, n), FLOAT), carray(pointer(B.v_at), (arms, n), FLOAT)
    targets = carray(pointer(B.targets_at), (ticks, TARGET_SIZE), FLOAT)
    beliefs = carray(pointer(B.beliefs_at), B.believed, BELIEF)
    starts = carray(pointer(B.starts_at), (arms + 1,), WHOLE)
    events = carray(pointer(B.events_at), (starts[arms], 3), WHOLE)
    skipped = carray(pointer(B.skipped_at), (arms,), WHOLE)
    far = carray(pointer(B.position_error_at), (arms,), FLOAT)
    turned = carray(pointer(B.rotation_error_at), (arms,), FLOAT)
    clear = carray(pointer(B.clearance_at), (arms,), FLOAT)
    counts = carray(pointer(B.counts_at), (arms, STATUSES), WHOLE)
    first_bad = carray(pointer(B.first_bad_at), (arms,), WHOLE)
    trace = carray(pointer(B.trace_at), (arms, kept, n), FLOAT)
    done = 0
    for r in range(first, last):
        if skipped[r]:
            continue
        copy_words(model, used, own)
        at, present = (
            starts[r],
            _begin(K.state, K.criteria, K.feedback, K.gate, K.chain, q[r], v[r], B.returns),
        )
        for k in range(ticks):
            if B.stop != 0:
                return done
            while at < starts[r + 1] and events[at, 0] <= k:
                believe_event(
                    K.faults, K.limits, K.chain, K.qp, K.free, beliefs[events[at, 1]], events[at, 2]
                )
                look_again(K.scene)
                at += 1
            code = INVALID_INPUT
            if present:
                code = _tick(K, F, targets[k])
                far[r] = max(far[r], K.task.position_error)
                turned[r] = max(turned[r], K.task.rotation_error)
                if K.scene.pairs > 0:
                    clear[r] = min(clear[r], K.scene.distance)
            counts[r, code] += 1
            if code != OK and first_bad[r] < 0:
                first_bad[r] = k
            if kept > 0 and (k + 1) % B.every == 0:
                assign(trace[r, k // B.every], K.state.q_command, n)
        for i in range(n):
            q[r, i], v[r, i] = K.state.q_command[i], K.state.v_command[i]
        done += 1
    return done
