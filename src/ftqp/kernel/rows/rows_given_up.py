"""Rows of the task that were given up: the tip is drawn to them, and it is seen whether they can be held.

They go before the scheme, as a further task of level 2, so that as much of them is kept as the rows that are
left allow, and the tip comes back to them where it can, at the pace of the task.
Source: docs/theory/ways-out.md, "Fewer rows".
"""

from math import atan2, cos, sqrt
from typing import Any

from ftqp.kernel.jit import jit, part_jit, rare_jit
from ftqp.kernel.layout.enums import TARGET_ACCELERATION, TARGET_TWIST
from ftqp.kernel.layout.scene_room import BEFORE_SCHEME, FRAME
from ftqp.kernel.rows.further_tasks import TURNS

THERE_SHARE = 0.1
"""Rows come back where the tip is within this share of the task's tolerance of them, ..."""
NEAR_SHARE = 0.5
"""... or within this one, ..."""
LEFT_SHARE = 0.4
"""... and the command leaves no more than this share of what they ask for, ..."""
LEFT_FLOOR = 1e-3
"""... plus this [m/s2 or m/s]: a term of the objective is never followed exactly."""


@part_jit
def draw_to_rows(K: Any) -> None:
    """Let the term behind the planner's own draw the tip's rotation to that of the target.

    An arm that holds, as even what is left is out of reach, is not drawn: it would creep; nor is one beside a
    joint that swings freely, which that would speed up.
    """
    task, terms, chain = K.task, K.terms, K.chain
    at = terms.own
    T, P = task.target, chain.tip_rotation
    for i in range(3):  # how the body of the tip would have to stand: R_target R_tip'
        for j in range(3):
            terms.turn[at, 3 * i + j] = (
                T[4 * i] * P[3 * j] + T[4 * i + 1] * P[3 * j + 1] + T[4 * i + 2] * P[3 * j + 2]
            )
    for k in range(3, 6):
        terms.rate[at, k] = T[TARGET_TWIST + k]
        terms.rate_change[at, k] = T[TARGET_ACCELERATION + k]
    terms.kind[at], terms.rows[at], terms.hard[at] = FRAME, TURNS, 0
    terms.body[at], terms.other[at] = chain.tip_joint, -1
    terms.kp[at], terms.kv[at] = task.kp, task.kv
    rests = K.calm.holding or K.faults.movable > K.faults.working
    terms.shares[at] = BEFORE_SCHEME
    terms.weight[at] = 0.0 if rests else 1.0


@jit
def is_whole(K: Any) -> bool:
    """Whether the tip is where the whole task has it, as far as rotation goes."""
    e = K.terms.error[K.terms.own]
    turned = sqrt(e[3] * e[3] + e[4] * e[4] + e[5] * e[5])
    return turned <= THERE_SHARE * K.feedback.rotation_tolerance


@rare_jit
def more_rows_hold(K: Any) -> bool:
    """Whether the next larger set of rows is reached, or nearly, by a command that is the one it asks for."""
    task, terms, qp, J, n = K.task, K.terms, K.qp, K.kinematics.J, K.chain.n
    at = terms.own
    if terms.count == at:
        return True
    e, length = terms.error[at], terms.length
    a0 = a1 = a2 = 0.0
    turned = sqrt(e[3] * e[3] + e[4] * e[4] + e[5] * e[5])
    if task.tool_of[task.given_up - 1]:  # the tool's axis alone
        R, axis = K.kinematics.R_tip, task.axis
        a0 = R[0] * axis[2] + R[1] * axis[5] + R[2] * axis[8]
        a1 = R[3] * axis[2] + R[4] * axis[5] + R[5] * axis[8]
        a2 = R[6] * axis[2] + R[7] * axis[5] + R[8] * axis[8]
        u = (e[3] * a0 + e[4] * a1 + e[5] * a2) / max(turned, 1e-300)
        c = min(max(cos(turned) + (1.0 - cos(turned)) * u * u, -1.0), 1.0)
        turned = atan2(sqrt((1.0 - c) * (1.0 + c)), c)
    if turned <= THERE_SHARE * K.feedback.rotation_tolerance:
        return True
    if turned > NEAR_SHARE * K.feedback.rotation_tolerance:
        return False
    along = beyond = asked = left = 0.0
    for k in range(3):
        wanted = terms.asked[at, 3 + k]
        made = 0.0
        for i in range(n):
            made += J[3 + k, i] * qp.x[i]
        missing = length * made - wanted
        a = a0 if k == 0 else a1 if k == 1 else a2
        along += a * missing
        beyond += a * wanted
        asked += wanted * wanted
        left += missing * missing
    left, asked = max(left - along * along, 0.0), max(asked - beyond * beyond, 0.0)
    return sqrt(left) <= LEFT_SHARE * sqrt(asked) + LEFT_FLOOR
