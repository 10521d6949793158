"""Torque limits and free-swinging joints as rows of the QP."""

from math import inf
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import FREE, HEALTHY, VELOCITY


@jit
def fill(K: Any, at: int) -> int:
    """l <= M x <= u, one row a joint from row ``at`` of C on; the next free row.

    tau_min - h <= M a <= tau_max - h, times dt at the velocity level. A free-swinging joint's row is the
    equality tau = -(friction + viscous) v, with the velocity after the step: taken before it, where h has the
    joint's own viscous friction, strong friction on a light joint would be unstable. The row of a joint that
    is held, or asks for its brake, is open: the brake carries whatever is needed. Those of a body that floats
    are M_b a + h_b = 0, at the velocity level M_b v = 0: momentum stays what it is, and 0.
    Source: docs/theory/joint-failures.md, "Free-swinging"; Umetani and Yoshida 1989.
    """
    chain, limits, faults, state, kinematics, qp = K.chain, K.limits, K.faults, K.state, K.kinematics, K.qp
    asks = K.feedback.asks
    n = chain.n
    scale = state.dt if state.level == VELOCITY else 1.0
    for i in range(n):
        shift = -scale * kinematics.h[i]
        row = qp.C[at + i]
        for j in range(n):
            row[j] = kinematics.M[i, j]
            if state.level == VELOCITY:
                shift += kinematics.M[i, j] * state.v[j]
        row[n] = 0.0
        fault = faults.code[i]
        if i < chain.floating:
            qp.l[at + i] = qp.u[at + i] = 0.0 if state.level == VELOCITY else shift
        elif fault == FREE:
            own = chain.viscous[i]
            friction = faults.friction[i] + own
            row[i] += friction * state.dt
            qp.l[at + i] = qp.u[at + i] = shift + (
                scale * own * state.v[i] if state.level == VELOCITY else -faults.friction[i] * state.v[i]
            )
        elif fault == HEALTHY and not asks[i]:
            qp.l[at + i], qp.u[at + i] = shift - scale * limits.tau_max[i], shift + scale * limits.tau_max[i]
        else:
            qp.l[at + i], qp.u[at + i] = -inf, inf
    return at + n
