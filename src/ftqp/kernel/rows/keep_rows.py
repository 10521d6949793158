"""Points of the arm that stay on their side of a plane, as rows of the QP."""

from math import inf
from typing import Any

from ftqp.kernel.arm.points import moves, point_column, point_drift, point_of
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import ACCELERATION
from ftqp.kernel.rows.joint_intervals import braking, return_velocity, viability

HARDEST = 4.0
"""A point that is beyond its plane is braked by at most so many times what it is braked by before it. A guess
that tests/control/planner/test_keep.py has not contradicted."""
RETURN_SPEED = 1.0
"""The speed whose share a point comes back with [m/s]. A convention; how the share follows from the distance
is said in ``joint_intervals.return_velocity``."""


@jit
def _most(state: Any, v: float, d: float, brake: float) -> float:
    """The largest acceleration, or velocity, towards its plane of a point at the distance d with velocity v.

    It can still be braked before the plane, as a joint before its limit.
    """
    if d < 0.0:
        back = return_velocity(d, RETURN_SPEED)
        if state.level == ACCELERATION:
            return max((back - v) / state.dt, -HARDEST * brake)
        return max(back, v - HARDEST * brake * state.dt)
    if state.level == ACCELERATION:
        return viability(v, d, inf, inf, brake, state.dt)[0]
    return braking(v, d, inf, inf, brake, state.dt)[0]


@jit
def fill(K: Any, at: int) -> int:
    """normal' (J x + drift) >= -most, one row a point from row ``at`` of C on; the next free row.

    Source: docs/theory/joint-limits.md, "Points on their side of a plane".
    """
    chain, state, kinematics, qp, keeps = K.chain, K.state, K.kinematics, K.qp, K.keeps
    n = chain.n
    for t in range(keeps.count):
        body, normal, row = keeps.body[t], keeps.normal[t], qp.C[at + t]
        n0, n1, n2 = normal[0], normal[1], normal[2]
        p0, p1, p2 = point_of(kinematics, body, keeps.place[t])
        v = 0.0
        for j in range(n + 1):
            row[j] = 0.0
        for j in range(body + 1):
            if not moves(chain, j, body):
                continue
            z0, z1, z2 = point_column(kinematics, chain, j, p0, p1, p2)
            row[j] = n0 * z0 + n1 * z1 + n2 * z2
            v += row[j] * state.v[j]
        distance = n0 * p0 + n1 * p1 + n2 * p2 - keeps.offset[t]
        keeps.distance[t] = distance
        drift = 0.0
        if state.level == ACCELERATION:
            o = kinematics.o[body]
            d0, d1, d2 = point_drift(kinematics, chain, body, p0 - o[0], p1 - o[1], p2 - o[2])
            drift = n0 * d0 + n1 * d1 + n2 * d2
        qp.l[at + t], qp.u[at + t] = -_most(state, -v, distance, keeps.brake[t]) - drift, inf
    return at + keeps.count
