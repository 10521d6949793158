"""Many arms through one trajectory in closed loop, without Python inside."""

from collections.abc import Callable

import numpy as np

from ftqp.kernel.jit import carray, pointer
from ftqp.kernel.judge.ladder import climb
from ftqp.kernel.layout.enums import SOLVED, TARGET_SIZE, Status
from ftqp.kernel.layout.record import record_dtype
from ftqp.kernel.ticks.accepted_inputs import accept_state
from ftqp.kernel.ticks.steps import FLOAT
from ftqp.kernel.ticks.tick import prepare_plain

WHOLE = np.dtype(np.int64)
STATUSES = len(Status)
NOT_KNOWN = 1e300
"""Velocity of a joint that is to be locked, before its own motion is known."""


def rollout(capacity: int) -> Callable[..., int]:
    """Arms ``first`` to ``last - 1``, one after the other, each with a start and a fault of its own."""
    dtype = record_dtype(capacity)
    words = dtype.itemsize // 8

    def rollout(
        model_at: int,
        address: int,
        first: int,
        last: int,
        ticks: int,
        q_at: int,
        v_at: int,
        targets_at: int,
        events_at: int,
        rates_at: int,
        worst_at: int,
        counts_at: int,
    ) -> int:
        """The record at ``model_at`` is what every arm begins with; the one at ``address`` is worked in.

        q and v are (B, n), the final state on return; targets (ticks, 29); events (B, 3) joint, tick and code
        of a fault, joint -1 for none; rates (B,) locking deceleration; worst (B, 2) largest position [m] and
        rotation error [rad]; counts (B, number of statuses) ticks per status.
        """
        K = carray(pointer(address), 1, dtype)[0]
        state, task, faults = K.state, K.task, K.faults
        model, copy = carray(pointer(model_at), (words,), WHOLE), carray(pointer(address), (words,), WHOLE)
        n = carray(pointer(model_at), 1, dtype)[0].chain.n
        q, v = carray(pointer(q_at), (last, n), FLOAT), carray(pointer(v_at), (last, n), FLOAT)
        targets = carray(pointer(targets_at), (ticks, TARGET_SIZE), FLOAT)
        events, rates = (
            carray(pointer(events_at), (last, 3), WHOLE),
            carray(pointer(rates_at), (last,), FLOAT),
        )
        worst, counts = (
            carray(pointer(worst_at), (last, 2), FLOAT),
            carray(pointer(counts_at), (last, STATUSES), WHOLE),
        )
        for r in range(first, last):
            for w in range(words):
                copy[w] = model[w]
            for i in range(n):
                state.q_command[i], state.v_command[i] = q[r, i], v[r, i]
            K.feedback.fresh = 1
            for k in range(ticks):
                if events[r, 0] >= 0 and events[r, 1] == k:
                    joint = events[r, 0]
                    faults.code[joint] = events[r, 2]
                    faults.lock_rate[joint] = rates[r]
                    faults.lock_velocity[joint] = NOT_KNOWN
                    K.qp.warm = 0
                for i in range(n):
                    state.given_q[i], state.given_v[i] = state.q_command[i], state.v_command[i]
                for i in range(TARGET_SIZE):
                    task.target[i] = targets[k, i]
                accept_state(K, n)
                code = climb(K, prepare_plain(K), SOLVED)
                worst[r, 0] = max(worst[r, 0], task.position_error)
                worst[r, 1] = max(worst[r, 1], task.rotation_error)
                counts[r, code] += 1
            for i in range(n):
                q[r, i], v[r, i] = state.q_command[i], state.v_command[i]
        return 0

    return rollout
