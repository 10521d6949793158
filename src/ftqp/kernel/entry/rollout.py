"""Many arms through one trajectory in closed loop, one after the other, without Python inside."""

from typing import Any

import numpy as np

from ftqp.kernel.entry.kept_arms import GIVEN_WORDS, WORK_WORDS, begin_arm, tell_arm
from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.layout.enums import INVALID_INPUT, OK, TARGET_SIZE, Status
from ftqp.kernel.layout.record import dtype
from ftqp.kernel.maths.elementary import is_finite
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.ticks.steps import FLOAT, tick_as_told

__all__ = ["GIVEN_WORDS", "WORK_WORDS"]
WHOLE = np.dtype(np.int64)
FAULT = dtype("fault")
STATUSES = len(Status)


@jit
def _is_start(q: Any, v: Any) -> bool:
    """Whether an arm may begin at q and v, (n,) each: they are finite."""
    good = True
    for i in range(len(q)):
        good = good and is_finite(q[i]) and is_finite(v[i])
    return good


@jit
def rollout(
    model: Any, used: Any, what: Any, B: Any, A: Any, rows: Any, out: Any, own: Any, K: Any, mine: Any,
    G: Any, work: Any, F: Any, first: int, last: int,
) -> int:  # fmt: skip
    """How many of the arms ``first`` to ``last - 1``, begun as the model, were driven to the end."""
    n, arms, ticks = A.chain.n, B.arms, B.ticks
    kept = ticks // B.every if B.every > 0 else 0
    q, v = carray(pointer(B.q_at), (arms, n), FLOAT), carray(pointer(B.v_at), (arms, n), FLOAT)
    targets = carray(pointer(B.targets_at), (ticks, TARGET_SIZE), FLOAT)
    faults = carray(pointer(B.faults_at), (B.kinds,), FAULT)
    starts = carray(pointer(B.starts_at), (arms + 1,), WHOLE)
    events = carray(pointer(B.events_at), (starts[arms], 3), WHOLE)
    far = carray(pointer(B.position_error_at), (arms,), FLOAT)
    turned = carray(pointer(B.rotation_error_at), (arms,), FLOAT)
    clear = carray(pointer(B.clearance_at), (arms,), FLOAT)
    counts = carray(pointer(B.counts_at), (arms, STATUSES), WHOLE)
    first_bad = carray(pointer(B.first_bad_at), (arms,), WHOLE)
    trace = carray(pointer(B.trace_at), (arms, kept, n), FLOAT)
    for r in range(first, last):
        at, present = starts[r], _is_start(q[r], v[r])
        if present:
            begin_arm(model, used, what, own, K, mine, G, work, q[r], v[r])
        for k in range(ticks):
            if B.stop != 0:
                return r - first
            code = INVALID_INPUT
            if present:
                while at < starts[r + 1] and events[at, 0] <= k:
                    tell_arm(K, G, A, faults[events[at, 1]], 1, events[at, 2], rows, out)
                    at += 1
                code = tick_as_told(K, G, F, K.state.q_command, K.state.v_command, targets[k])
                far[r] = max(far[r], K.task.position_error)
                turned[r] = max(turned[r], K.task.rotation_error)
                if K.scene.pairs > 0:
                    clear[r] = min(clear[r], K.scene.distance)
                for i in range(n):
                    q[r, i], v[r, i] = K.state.q_command[i], K.state.v_command[i]
            counts[r, code] += 1
            if code != OK and first_bad[r] < 0:
                first_bad[r] = k
            if kept > 0 and (k + 1) % B.every == 0:
                assign(trace[r, k // B.every], q[r], n)
    return last - first
