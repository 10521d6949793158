"""The posture that a plan asks for, found anew at every tick from where the tip is on it.

Source: docs/theory/following-a-plan.md.
"""

from typing import Any

import numpy as np

from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.layout.enums import VELOCITY
from ftqp.kernel.maths.linear_systems import assign

FLOAT = np.dtype(np.float64)

STANDS = 1e-9
"""Rows whose tips are nearer than this are passed by the clock [m]. A million units of rounding of forward
kinematics."""
SAME = 1e-6
"""Two places on the plan are equally near within this distance [m]."""
FASTEST = 2.0
"""The plan is followed at this multiple of its own speed at most."""
SETTLES = 0.02
"""The pace follows the tip with this time constant [s]."""


@jit
def along(P: Any, tips: Any, k: int) -> Any:
    """How far on the way from row k to k + 1 the tip is, and the square of that way [m2]."""
    dot, square, weight = 0.0, 0.0, 0.5 * P.length * P.length
    for c in range(12):
        w = 1.0 if c < 3 else weight
        chord = tips[k + 1, c] - tips[k, c]
        dot += w * chord * (P.tip[c] - tips[k, c])
        square += w * chord * chord
    return (dot / square if square > 0.0 else 0.0), square


@jit
def off_segment(P: Any, tips: Any, k: int, share: float) -> float:
    """Square of the distance of the tip from a place between rows k and k + 1 [m2]."""
    square, weight = 0.0, 0.5 * P.length * P.length
    for c in range(12):
        gap = tips[k, c] + share * (tips[k + 1, c] - tips[k, c]) - P.tip[c]
        square += (1.0 if c < 3 else weight) * gap * gap
    return square


@jit
def place(P: Any, tips: Any, dt: float) -> float:
    """Where the tip is, counted in rows: the nearest place to the last one.

    Among rows whose tips are the same, as where the tip stands and the arm moves, the clock goes on. Where
    the plan goes back the way it came, the place goes on.
    """
    last = P.rows - 1
    k = min(int(P.at), last - 1)
    share, square = along(P, tips, k)
    if square <= STANDS * STANDS:
        return min(float(last), P.at + dt / P.spacing)
    while share > 1.0 and k + 1 < last:
        k += 1
        share, square = along(P, tips, k)
        if square <= STANDS * STANDS:
            return float(k)
    while share < 0.0 and k > 0:
        before, square = along(P, tips, k - 1)
        if square <= STANDS * STANDS or before >= 1.0:
            break
        k -= 1
        share = before
    share = min(max(share, 0.0), 1.0)
    if k + share < P.at and k + 1 < last:
        onward, square = along(P, tips, k + 1)
        onward = min(max(onward, 0.0), 1.0)
        near = off_segment(P, tips, k, share)
        if off_segment(P, tips, k + 1, onward) <= near + SAME * SAME:
            return k + 1 + onward
    return k + share


@jit
def row_speed(q: Any, k: int, last: int, i: int) -> float:
    """What joint i moves from row to row at row k, by central differences."""
    if k == 0:
        return q[1, i] - q[0, i]
    if k == last:
        return q[last, i] - q[last - 1, i]
    return 0.5 * (q[k + 1, i] - q[k - 1, i])


@jit
def update_reference(state: Any, criteria: Any, chain: Any, P: Any, q: Any) -> None:
    """The posture whose pull is that of a plan that moves: q_p + (norm_v v_p + norm a_p)/norm_q.

    At the velocity level it is q_p + norm v_p/norm_q. Between rows the plan is the cubic through their
    positions and speeds.
    """
    last = P.rows - 1
    k = min(int(P.at), last - 1)
    u = P.at - k
    pace = P.pace
    velocity_level = state.level == VELOCITY
    for i in range(chain.n):
        begin, end = q[k, i], q[k + 1, i]
        out, into = row_speed(q, k, last, i), row_speed(q, k + 1, last, i)
        second = 3.0 * (end - begin) - 2.0 * out - into
        third = 2.0 * (begin - end) + out + into
        position = begin + u * (out + u * (second + u * third))
        speed = (out + u * (2.0 * second + 3.0 * u * third)) * pace
        if velocity_level:
            ahead = criteria.norm * speed
        else:
            ahead = criteria.norm_v * speed + criteria.norm * (2.0 * second + 6.0 * u * third) * pace * pace
        criteria.posture[i] = position + ahead / criteria.norm_q


@jit
def follow(state: Any, criteria: Any, kinematics: Any, chain: Any, P: Any, q: Any, tips: Any) -> None:
    """The posture of the next tick, from the tip of the last one."""
    dt = state.dt
    if P.begun:
        assign(P.tip, kinematics.o_tip, 3)
        for c in range(9):
            P.tip[3 + c] = kinematics.R_tip[c]
        found = place(P, tips, dt)
        pace = min(max((found - P.at) / dt, 0.0), FASTEST / P.spacing)
        P.pace += dt / (SETTLES + dt) * (pace - P.pace)
        P.at = found
    P.begun = 1
    update_reference(state, criteria, chain, P, q)


@jit
def follow_plan(K: Any, P: Any) -> None:
    """The posture of a planner's next tick, from the plan's record."""
    q = carray(pointer(P.q_at), (P.rows, K.chain.n), FLOAT)
    tips = carray(pointer(P.tip_at), (P.rows, 12), FLOAT)
    follow(K.state, K.criteria, K.kinematics, K.chain, P, q, tips)
