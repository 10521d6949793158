"""Arms whose records live between calls: begun, given faults and stepped, each as a planner of its own."""

from typing import Any

import numpy as np

from ftqp.kernel.arm.kinematics import forward_kinematics
from ftqp.kernel.commands.believed import begin_to_believe, believe, believe_found, count_on, forget_finding
from ftqp.kernel.commands.stops import hold_up, start
from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.layout.enums import FREE, MEASURED, NEWS
from ftqp.kernel.layout.record import dtype
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.ticks.steps import tick_as_told

WORD = np.dtype(np.int64)
RECORD, GIVEN, WORK = dtype("record"), dtype("given"), dtype("free")
RECORD_WORDS, GIVEN_WORDS, WORK_WORDS = RECORD.itemsize // 8, GIVEN.itemsize // 8, WORK.itemsize // 8
FOUND_LOCKED, FOUND_FREE = 1, 2
"""What is counted on of a joint that the monitor has found: that it is locked, or that it swings freely."""


@jit
def copy_words(of: Any, used: Any, to: Any) -> None:
    """Copy runs of words, (k, 2) of their begins and ends."""
    for k in range(len(used)):
        for w in range(used[k, 0], used[k, 1]):
            to[w] = of[w]


@jit
def begin_arm(
    model: Any, used: Any, what: Any, words: Any, K: Any, given_words: Any, given: Any, work: Any, q: Any,
    v: Any,
) -> None:  # fmt: skip
    """Make an arm what the model is in its used words, and begin at (q, v), (n,) each; words are K, given."""
    if given.swings:
        work[:] = 0
    copy_words(model, used, words)
    for w in range(GIVEN_WORDS):
        given_words[w] = what[w]
    start(K, given, q, v)


@jit
def tell_arm(K: Any, given: Any, A: Any, fault: Any, goes_on: int, weak: int, rows: Any, out: Any) -> None:
    """Let an arm count on a fault of a joint, or that it works, as ``planner.report``."""
    believe(K.faults, K.limits, given, fault, goes_on)
    begin_to_believe(K, given)
    count_on(K, given, rows, out)
    if weak:
        hold_up(K, A, fault.joint)


@jit
def begin_arms(
    model: Any, used: Any, what: Any, records_at: int, givens_at: int, works_at: int, mask: Any, q: Any,
    v: Any, found: Any, first: int, last: int,
) -> None:  # fmt: skip
    """Begin those arms that are meant as the model, at (q, v), (count, n)."""
    count = len(mask)
    words = carray(pointer(records_at), (count, RECORD_WORDS), WORD)
    given_words = carray(pointer(givens_at), (count, GIVEN_WORDS), WORD)
    work_words = carray(pointer(works_at), (count, WORK_WORDS), WORD)
    records = carray(pointer(records_at), (count,), RECORD)
    givens = carray(pointer(givens_at), (count,), GIVEN)
    for r in range(first, last):
        if mask[r]:
            found[r, : records[r].chain.n] = 0
            begin_arm(
                model, used, what, words[r], records[r], given_words[r], givens[r], work_words[r], q[r], v[r]
            )


@jit
def tell_arms(
    records_at: int, givens_at: int, A: Any, fault: Any, mask: Any, news: Any, goes_on: Any, weak: int,
    rows: Any, out: Any, found: Any,
) -> None:  # fmt: skip
    """Let arms to which it is news count on a fault of a joint; all forget what was found of it."""
    count = len(mask)
    records = carray(pointer(records_at), (count,), RECORD)
    givens = carray(pointer(givens_at), (count,), GIVEN)
    for r in range(count):
        if news[r]:
            tell_arm(records[r], givens[r], A, fault, goes_on[r], weak, rows, out)
        if mask[r] and records[r].monitor.names:
            forget_finding(records[r], fault.joint)
            found[r, fault.joint] = 0


@jit
def step_arms(
    records_at: int, givens_at: int, works_at: int, mask: Any, targets: Any, q: Any, v: Any, sent: Any,
    found: Any, status: Any, error: Any, ticks: int, first: int, last: int,
) -> int:  # fmt: skip
    """So many ticks of each arm that is meant from (q, v) to its target, (count, 29): 0, or a mistake."""
    count = len(q)
    records = carray(pointer(records_at), (count,), RECORD)
    givens = carray(pointer(givens_at), (count,), GIVEN)
    works = carray(pointer(works_at), (count,), WORK)
    for r in range(first, last):
        if not mask[r]:
            continue
        K = records[r]
        for _ in range(ticks):
            code = tick_as_told(K, givens[r], works[r], q[r], v[r], targets[r])
            if code < 0:
                return code
            if code >= NEWS:
                believe_found(K, givens[r])
                code -= NEWS
            status[r] = code
            for i in range(K.chain.n):
                q[r, i], v[r, i] = K.state.q_command[i], K.state.v_command[i]
        for i in range(K.chain.n):
            sent[r, 0, i], sent[r, 1, i] = K.feedback.q_sent[i], K.feedback.v_sent[i]
            if K.monitor.names:
                swings = K.faults.code[i] == FREE or K.faults.code[i] == MEASURED
                kind = FOUND_FREE if swings else FOUND_LOCKED
                found[r, i] = kind if K.monitor.counted[i] else 0
        error[r, 0], error[r, 1] = K.task.position_error, K.task.rotation_error
    return 0


@jit
def poses(A: Any, q: Any, out: Any) -> None:
    """The pose of the end effector at each q, (count, n), as a matrix, (count, 16)."""
    for r in range(len(q)):
        assign(A.state.q, q[r], A.chain.n)
        forward_kinematics(A, A.state)
        out[r, :16] = 0.0
        for a in range(3):
            for b in range(3):
                out[r, 4 * a + b] = A.kinematics.R_tip[3 * a + b]
            out[r, 4 * a + 3] = A.kinematics.o_tip[a]
        out[r, 15] = 1.0
