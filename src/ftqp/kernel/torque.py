"""Torque limits and free-swinging joints as rows of the QP."""

from math import inf
from typing import Any

from ftqp.kernel.codes import BRAKING, FREE, LOCKED, VELOCITY
from ftqp.kernel.jit import jit


@jit
def torque_rows(K: Any) -> None:
    """l <= M x <= u, one row a joint: tau_min - h <= M a <= tau_max - h, times dt at the velocity level.

    A free-swinging joint's row is the equality tau = -damping v; a braking or locked joint's row is open, its brake
    carries whatever is needed.
    """
    n = K.n
    K.nc = n if K.dynamic else 0
    if not K.dynamic:
        return
    scale = K.dt if K.level == VELOCITY else 1.0
    for i in range(n):
        shift = -scale * K.h[i]
        for j in range(n):
            K.C[i, j] = K.M[i, j]
            if K.level == VELOCITY:
                shift += K.M[i, j] * K.v[j]
        K.C[i, n] = 0.0
        fault = K.fault[i]
        if fault == FREE:
            K.l[i] = K.u[i] = shift - scale * K.damping[i] * K.v[i]
        elif fault == LOCKED or fault == BRAKING:
            K.l[i], K.u[i] = -inf, inf
        else:
            K.l[i], K.u[i] = shift - scale * K.tau_max[i], shift + scale * K.tau_max[i]
