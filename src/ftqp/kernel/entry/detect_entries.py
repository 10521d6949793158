"""The detector's ways in: a tick of given arrays, and many ticks of a log."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ftqp.kernel.compiled.taking import take
from ftqp.kernel.detection.detecting import detect_tick
from ftqp.kernel.detection.told_detector import tell
from ftqp.kernel.entry.arm_in_view import see_arm
from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.layout.detection_room import RESIDUALS, detection_dtype
from ftqp.kernel.layout.enums import NOT_READ, TORQUE_DRIVE, WRONG_SHAPE
from ftqp.kernel.layout.record import arm_dtype, record_dtype

FLOAT = np.dtype(np.float64)


WHOLE = np.dtype(np.int64)
COLUMNS = 6
"""Of a log: q, tau, then q, v, a and the torque of the reference."""


@jit
def _accept(D: Any, q: Any, tau: Any, q_ref: Any, v_ref: Any, a_ref: Any, effort: Any) -> int:
    """Copy what a tick is given: 0, or a mistake (negative). Torques may be absent: arrays of no numbers."""
    n, room = D.n, len(D.q)
    of_q = take(q, 0, D.q.ctypes.data, room, 1)
    of_q_ref = take(q_ref, 0, D.q_ref.ctypes.data, room, 1)
    of_v_ref = take(v_ref, 0, D.v_ref.ctypes.data, room, 1)
    of_a_ref = take(a_ref, 0, D.a_ref.ctypes.data, room, 1)
    D.got_tau = take(tau, 0, D.tau.ctypes.data, room, 1)
    D.got_effort = take(effort, 0, D.effort.ctypes.data, room, 1)
    if of_q < 0 or of_q_ref < 0 or of_v_ref < 0 or of_a_ref < 0 or D.got_tau < 0 or D.got_effort < 0:
        return NOT_READ
    if of_q != n or of_q_ref != n or of_v_ref != n or of_a_ref != n:
        return WRONG_SHAPE
    if (D.got_tau != n and D.got_tau != 0) or (D.got_effort != n and D.got_effort != 0):
        return WRONG_SHAPE
    return 0


def detect(capacity: int) -> Callable[..., int]:
    """A tick of a detector: what ``ftqp.kernel.detection.detecting`` answers, or a mistake."""
    dtype, arm = detection_dtype(capacity), arm_dtype(capacity)

    def detect(
        address: int, arm_at: int, q: Any, tau: Any, q_ref: Any, v_ref: Any, a_ref: Any, effort: Any
    ) -> int:
        D = carray(pointer(address), 1, dtype)[0]
        code = _accept(D, q, tau, q_ref, v_ref, a_ref, effort)
        if code < 0:
            return code
        return detect_tick(D, carray(pointer(arm_at), 1, arm)[0])

    return detect


def watch(capacity: int) -> Callable[..., int]:
    """A tick of a detector after one of a planner: what ``detecting`` answers.

    It sees what the planner was given and the reference that came of it. At ``tau_at`` lie measured torques;
    0 is none.
    """
    dtype, record, arm = detection_dtype(capacity), record_dtype(capacity), arm_dtype(capacity)

    def watch(address: int, detector_at: int, arm_at: int, tau_at: int) -> int:
        K, D = carray(pointer(address), 1, record)[0], carray(pointer(detector_at), 1, dtype)[0]
        A, n, state = carray(pointer(arm_at), 1, arm)[0], D.n, K.state
        see_arm(D, A, K)
        D.got_tau = n if tau_at != 0 else 0
        D.got_effort = n if K.feedback.kind == TORQUE_DRIVE else 0
        D.probed = K.criteria.sways
        tau = carray(pointer(tau_at), (D.got_tau,), FLOAT)
        for i in range(n):
            D.q[i], D.q_ref[i] = state.given_q[i], state.q_command[i]
            D.v_ref[i], D.a_ref[i] = state.v_command[i], state.a_command[i]
            if D.got_tau:
                D.tau[i] = tau[i]
            if D.got_effort:
                D.effort[i] = K.feedback.tau_sent[i]
        return detect_tick(D, A)

    return watch


def tell_detector(capacity: int) -> Callable[..., int]:
    """What a detector is told, a ``ToldDetector``, and of which joint."""
    dtype = detection_dtype(capacity)

    def tell_detector(detector_at: int, joint: int, what: int) -> int:
        tell(carray(pointer(detector_at), 1, dtype)[0], joint, what)
        return 0

    return tell_detector


def detect_log(capacity: int) -> Callable[..., int]:
    """Many ticks of a log: how many were done, up to the first that answers ``until`` or more."""
    dtype, arm = detection_dtype(capacity), arm_dtype(capacity)

    def detect_log(
        address: int, arm_at: int, table_at: int, rows: int, first: int, last: int, block: int, peaks_at: int,
        trace_at: int, until: int,
    ) -> int:  # fmt: skip
        """Rows ``first`` to ``last - 1`` of columns whose addresses are in the table; 0 is an absent one.

        The largest excess of every residual over ``block`` rows goes into ``peaks``, (rows // block, 9, N),
        z of every row into ``trace``, (rows,).
        """
        D = carray(pointer(address), 1, dtype)[0]
        K = carray(pointer(arm_at), 1, arm)[0]
        n, N = D.n, len(D.q)
        table = carray(pointer(table_at), (COLUMNS,), WHOLE)
        peaks = carray(pointer(peaks_at), (rows // block, RESIDUALS, N), FLOAT)
        trace = carray(pointer(trace_at), (rows,), FLOAT)
        q = carray(pointer(table[0]), (rows, n), FLOAT)
        q_ref = carray(pointer(table[2]), (rows, n), FLOAT)
        v_ref = carray(pointer(table[3]), (rows, n), FLOAT)
        a_ref = carray(pointer(table[4]), (rows, n), FLOAT)
        tau = carray(pointer(table[1]), (rows if table[1] != 0 else 0, n), FLOAT)
        effort = carray(pointer(table[5]), (rows if table[5] != 0 else 0, n), FLOAT)
        D.got_tau = n if table[1] != 0 else 0
        D.got_effort = n if table[5] != 0 else 0
        for k in range(first, last):
            for i in range(n):
                D.q[i], D.q_ref[i], D.v_ref[i], D.a_ref[i] = q[k, i], q_ref[k, i], v_ref[k, i], a_ref[k, i]
                if D.got_tau:
                    D.tau[i] = tau[k, i]
                if D.got_effort:
                    D.effort[i] = effort[k, i]
            answer = detect_tick(D, K)
            trace[k] = D.worst
            if (k + 1) % block == 0:
                for r in range(RESIDUALS):
                    for i in range(N):
                        peaks[k // block, r, i] = D.peak[r, i]
                        D.peak[r, i] = 0.0
            if answer >= until:
                return k + 1
        return last

    return detect_log
