"""The detector's ways in: a tick of given arrays, one beside a planner, and many ticks of a log."""

from typing import Any

from ftqp.kernel.detection.detecting import detect_tick
from ftqp.kernel.feedback.learned_inertia import is_known
from ftqp.kernel.jit import jit, take
from ftqp.kernel.layout.detection_room import RESIDUALS
from ftqp.kernel.layout.enums import NOT_READ, TORQUE_DRIVE, WRONG_SHAPE
from ftqp.kernel.layout.thresholds import PUSHED

BEYOND_FRICTION = 0.8
"""Friction of which nobody knows holds no push of this share of the most that it is taken for, ``PUSHED`` of
the torque limit. Less than one, so that a joint that is pushed harder and harder gets there."""
UNSURE = 1.3
"""Friction that is known may hold so many times itself, as it may have changed by 30 % (``FRICTION_UNSURE``)
since it was identified."""
LEAST_HELD = 0.02
"""And any joint this [N m or N]."""

DOUBTS = 3.0
"""A rotor may be so many standard deviations heavier than it counts: two, as usual for errors, and one by
which it counts less than its estimate."""


@jit
def see_arm(D: Any, A: Any, K: Any) -> None:
    """Take what the planner K has learned of its arm into the arm A that the detector D looks at.

    It stands still while something is suspected, because the planner learns from the fault, too. Until the
    planner knows its arm the means of residuals are not begun, so that no fault is read out of the model's
    errors. ``holds`` is the push of a motor that friction may hold: known friction, or as much as the planner
    pushes a joint that sticks; ``doubt`` is the rotor that a joint may have beside what counts.
    Source: docs/theory/detection.md, "The arm that is looked at".
    """
    learned = K.learned
    if learned.on == 0 or learned.based == 0:
        return
    if not is_known(K.state, learned):
        D.taken = 0
    if D.watch != 0:
        return
    body = K.chain.tip_joint
    A.chain.mass[body] = K.chain.mass[body]
    for k in range(3):
        A.chain.com[body, k] = K.chain.com[body, k]
    for k in range(6):
        A.chain.inertia[body, k] = K.chain.inertia[body, k]
    for i in range(D.n):
        A.chain.armature[i] = K.chain.armature[i]
        D.doubt[i] = DOUBTS * learned.sigma[i]
        D.coulomb[i] = max(D.told_coulomb[i], learned.friction[i])
        if D.told_coulomb[i] < 0.0:
            D.holds[i] = BEYOND_FRICTION * PUSHED * D.tau_max[i]
        else:
            D.holds[i] = UNSURE * D.coulomb[i] + LEAST_HELD


__all__ = ["RESIDUALS"]


@jit
def accept(D: Any, q: Any, tau: Any, q_ref: Any, v_ref: Any, a_ref: Any, effort: Any) -> int:
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


@jit
def watch(K: Any, D: Any, A: Any, tau: Any) -> int:
    """A tick of a detector after one of a planner: what ``detecting`` answers.

    It sees what the planner was given and the reference that came of it; ``tau`` is empty where no torques
    were measured.
    """
    n, state = D.n, K.state
    see_arm(D, A, K)
    D.got_tau = len(tau)
    D.got_effort = n if K.feedback.kind == TORQUE_DRIVE else 0
    D.probed = K.criteria.sways
    for i in range(n):
        D.q[i], D.q_ref[i] = state.given_q[i], state.q_command[i]
        D.v_ref[i], D.a_ref[i] = state.v_command[i], state.a_command[i]
        if D.got_tau:
            D.tau[i] = tau[i]
        if D.got_effort:
            D.effort[i] = K.feedback.tau_sent[i]
    return detect_tick(D, A)


@jit
def detect_log(
    D: Any, A: Any, q: Any, tau: Any, q_ref: Any, v_ref: Any, a_ref: Any, effort: Any, first: int, last: int,
    block: int, peaks: Any, trace: Any, until: int,
) -> int:  # fmt: skip
    """Rows ``first`` to ``last - 1`` of a log: how many were done, up to the first that answers ``until``.

    Absent torques are empty. The largest excess of every residual over ``block`` rows goes into ``peaks``,
    (rows // block, 9, N), z of every row into ``trace``, (rows,).
    """
    n, N = D.n, len(D.q)
    D.got_tau, D.got_effort = n if len(tau) else 0, n if len(effort) else 0
    for k in range(first, last):
        for i in range(n):
            D.q[i], D.q_ref[i], D.v_ref[i], D.a_ref[i] = q[k, i], q_ref[k, i], v_ref[k, i], a_ref[k, i]
            if D.got_tau:
                D.tau[i] = tau[k, i]
            if D.got_effort:
                D.effort[i] = effort[k, i]
        answer = detect_tick(D, A)
        trace[k] = D.worst
        if (k + 1) % block == 0:
            for r in range(RESIDUALS):
                for i in range(N):
                    peaks[k // block, r, i] = D.peak[r, i]
                    D.peak[r, i] = 0.0
        if answer >= until:
            return k + 1
    return last
