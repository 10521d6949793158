"""Arms whose records live between calls: begun, told of faults and stepped, each as a planner of its own."""

from typing import Any

import numpy as np

from ftqp.kernel.arm.kinematics import forward_kinematics
from ftqp.kernel.commands.believed import begin_to_believe, believe, count_on
from ftqp.kernel.commands.stops import hold_up, start
from ftqp.kernel.entry.rollout import copy_words
from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.layout.record import dtype
from ftqp.kernel.ticks.steps import TARGET_SIZE, tick_by_the_clock

__all__ = ["TARGET_SIZE"]
WORD = np.dtype(np.int64)
RECORD, GIVEN = dtype("record"), dtype("given")
RECORD_WORDS, GIVEN_WORDS = RECORD.itemsize // 8, GIVEN.itemsize // 8


@jit
def begin_arms(
    model: Any, used: Any, what: Any, records_at: int, givens_at: int, mask: Any, q: Any, v: Any, first: int,
    last: int,
) -> None:  # fmt: skip
    """Make those arms that are meant what the model is in its used words, and begin at (q, v), (count, n)."""
    count = len(mask)
    words = carray(pointer(records_at), (count * RECORD_WORDS,), WORD)
    given_words = carray(pointer(givens_at), (count * GIVEN_WORDS,), WORD)
    records = carray(pointer(records_at), (count,), RECORD)
    givens = carray(pointer(givens_at), (count,), GIVEN)
    for r in range(first, last):
        if mask[r]:
            copy_words(model, used, words[r * RECORD_WORDS : (r + 1) * RECORD_WORDS])
            for w in range(GIVEN_WORDS):
                given_words[r * GIVEN_WORDS + w] = what[w]
            start(records[r], givens[r], q[r], v[r])


@jit
def tell_arms(
    records_at: int, givens_at: int, A: Any, fault: Any, mask: Any, goes_on: Any, weak: int, rows: Any,
    out: Any,
) -> None:  # fmt: skip
    """Let those arms that are meant believe a fault of a joint, or that it works, as ``planner.report``."""
    count = len(mask)
    records = carray(pointer(records_at), (count,), RECORD)
    givens = carray(pointer(givens_at), (count,), GIVEN)
    for r in range(count):
        if mask[r]:
            K, given = records[r], givens[r]
            believe(K.faults, K.limits, given, fault, goes_on[r])
            begin_to_believe(K, given)
            count_on(K, given, rows, out)
            if weak:
                hold_up(K, A, fault.joint)


@jit
def step_arms(
    records_at: int, givens_at: int, targets: Any, q: Any, v: Any, sent: Any, status: Any, error: Any,
    ticks: int, first: int, last: int,
) -> int:  # fmt: skip
    """So many ticks of each arm towards its own target, (count, 29): 0, or the mistake in one.

    The first begins at (q, v), (count, n), each other one where the last has led, and so do these on return;
    ``sent``, (count, 2, n), is then what the drives are told.
    """
    count = len(q)
    records = carray(pointer(records_at), (count,), RECORD)
    givens = carray(pointer(givens_at), (count,), GIVEN)
    for r in range(first, last):
        K = records[r]
        for _ in range(ticks):
            code = tick_by_the_clock(K, givens[r], q[r], v[r], targets[r])
            if code < 0:
                return code
            status[r] = code
            for i in range(K.chain.n):
                q[r, i], v[r, i] = K.state.q_command[i], K.state.v_command[i]
        for i in range(K.chain.n):
            sent[r, 0, i], sent[r, 1, i] = K.feedback.q_sent[i], K.feedback.v_sent[i]
        error[r, 0], error[r, 1] = K.task.position_error, K.task.rotation_error
    return 0


@jit
def poses(A: Any, q: Any, out: Any) -> None:
    """The pose of the end effector at each q, (count, n), as a matrix, (count, 16)."""
    for r in range(len(q)):
        for i in range(A.chain.n):
            A.state.q[i] = q[r, i]
        forward_kinematics(A, A.state)
        for k in range(16):
            out[r, k] = 0.0
        for a in range(3):
            for b in range(3):
                out[r, 4 * a + b] = A.kinematics.R_tip[3 * a + b]
            out[r, 4 * a + 3] = A.kinematics.o_tip[a]
        out[r, 15] = 1.0
