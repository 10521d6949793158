"""Rows of the user's own, which Python has filled before the tick."""

from typing import Any

from ftqp.kernel.arm.mimicry import fold_row
from ftqp.kernel.jit import jit


@jit
def fill(K: Any, at: int) -> int:
    """l <= C x <= u of the user's own, from row ``at`` of C on; the next free row."""
    keeps, qp, n = K.keeps, K.qp, K.chain.n
    for k in range(keeps.own):
        for j in range(n):
            qp.C[at + k, j] = keeps.own_C[k, j]
        qp.C[at + k, n] = 0.0
        if K.chain.mimics:
            fold_row(K.chain, qp.C[at + k])
        qp.l[at + k], qp.u[at + k] = keeps.own_l[k], keeps.own_u[k]
    return at + keeps.own
