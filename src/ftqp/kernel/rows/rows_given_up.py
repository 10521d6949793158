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
from ftqp.kernel.maths.vectors import ZERO, column, inner, length, minus, plus, three_from, times
from ftqp.kernel.rows.further_tasks import TURNS
from ftqp.kernel.rows.task_rows import tool_axis

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
    rests = K.settling.holding or K.faults.movable > K.faults.working
    terms.shares[at] = BEFORE_SCHEME
    terms.weight[at] = 0.0 if rests else 1.0


@jit
def is_whole(K: Any) -> bool:
    """Whether the tip is where the whole task has it, as far as rotation goes."""
    turned = length(three_from(K.terms.error[K.terms.own], 3))
    return turned <= THERE_SHARE * K.feedback.rotation_tolerance


@rare_jit
def more_rows_hold(K: Any) -> bool:
    """Whether the next larger set of rows is reached, or nearly, by a command that is the one it asks for."""
    task, terms, qp, J, n = K.task, K.terms, K.qp, K.kinematics.J, K.chain.n
    at = terms.own
    if terms.count == at:
        return True
    e, axis = three_from(terms.error[at], 3), ZERO
    turned = length(e)
    if task.tool_of[task.given_up - 1]:  # the tool's axis alone
        axis = tool_axis(task, K.kinematics, 2)
        u = inner(e, axis) / max(turned, 1e-300)
        c = min(max(cos(turned) + (1.0 - cos(turned)) * u * u, -1.0), 1.0)
        turned = atan2(sqrt((1.0 - c) * (1.0 + c)), c)
    if turned <= THERE_SHARE * K.feedback.rotation_tolerance:
        return True
    if turned > NEAR_SHARE * K.feedback.rotation_tolerance:
        return False
    made = ZERO
    for i in range(n):
        made = plus(made, times(qp.x[i], column(J, 3, i)))
    wanted = three_from(terms.asked[at], 3)
    missing = minus(times(terms.length, made), wanted)
    left = max(inner(missing, missing) - inner(axis, missing) ** 2, 0.0)
    asked = max(inner(wanted, wanted) - inner(axis, wanted) ** 2, 0.0)
    return sqrt(left) <= LEFT_SHARE * sqrt(asked) + LEFT_FLOOR
