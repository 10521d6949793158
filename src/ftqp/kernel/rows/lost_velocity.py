"""What the tip loses where a joint stops otherwise than was foreseen, and how soon the others give it back.

A brake closes within milliseconds, and a failure that nobody told of is believed when the joint has long
stood. The reference then loses the velocity J_F dv_F at once. The task's feedback alone would take it back
with its own time constant, 1/kv, though the joints that work could do it sooner.
"""

from math import inf
from typing import Any

from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import ACCELERATION, TARGET_TWIST
from ftqp.kernel.rows.failed_joints import least_jump

UNFORESEEN = 1e-6
"""A velocity that differs from what was foreseen by less is left to the feedback [rad/s or m/s]: such a
difference moves no tip by more than a micrometre a second. A convention."""
SHARE = 0.8
"""Share of the acceleration limits with which it is given back; the rest is left for the task itself. A
guess, between the quarter that a ramp takes and all of it."""


@jit
def loses(K: Any) -> bool:
    """Whether velocity is being given back, or may be lost in this tick."""
    return bool(K.task.owes or K.faults.movable < K.chain.n)


@rare_jit
def give_back(K: Any) -> None:
    """Add what the joints that work can give back in this tick to the acceleration that the task asks for.

    With delta = J_H^+ lost that is lost s / dt, s = min(1, dt SHARE min_i a_max,i / |delta_i|). What is lost
    is no more than what the reference's velocity lacks now, so that it ends when that is there again.
    Source: docs/theory/joint-failures.md, "Locked".
    """
    state, faults, task, feedback, chain = K.state, K.faults, K.task, K.feedback, K.chain
    J, lost = K.kinematics.J, task.lost
    if not feedback.displaced:
        for c in range(6):
            feedback.push[c] = 0.0
    if not feedback.active or state.level != ACCELERATION or K.watch.latched != 0:
        task.owes = 0
        return
    for k in range(faults.movable, chain.n):
        i = faults.order[k]
        jump = state.v[i] - K.gate.v[i]
        if abs(jump) > UNFORESEEN:
            if not task.owes:
                for c in range(6):
                    lost[c] = 0.0
            task.owes = 1
            for c in range(6):
                lost[c] += J[c, i] * jump
    if not task.owes:
        return
    left = 0.0
    for c in range(6):
        lacks = -task.target[TARGET_TWIST + c]
        for i in range(chain.n):
            lacks += J[c, i] * state.v[i]
        lost[c] = min(max(lost[c], min(lacks, 0.0)), max(lacks, 0.0))
        left = max(left, abs(lost[c]))
    if left <= UNFORESEEN:
        task.owes = 0
        return
    share = _share(K)
    for c in range(6):
        feedback.push[c] -= lost[c] * share / state.dt


@jit
def _share(K: Any) -> float:
    """The share of what is lost that the joints that work give back in a tick."""
    task, faults, scratch = K.task, K.faults, K.scratch
    for a in range(task.m):
        scratch.rows[a] = -task.lost[task.rows[a]]
    least_jump(faults, task, K.kinematics, K.chain, scratch)
    share = 1.0
    for k in range(faults.working):
        i = faults.order[k]
        most = SHARE * K.limits.a_max[i] * K.state.dt
        if most < inf and abs(scratch.joints[i]) > most:
            share = min(share, most / abs(scratch.joints[i]))
    return share
