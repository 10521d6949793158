"""Rows of pairs that keep apart, which ``ftqp.kernel.scene.clearance`` has found before."""

from math import inf
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.rows import CLEARANCES


@jit
def fill(K: Any, at: int) -> int:
    """G x >= least from row ``at`` of C on, one row a slot; the next free row.

    Empty slots have no ends. These rows give way where nothing else can: the first of them is
    ``qp.yields_from``.
    """
    n, qp, scene = K.chain.n, K.qp, K.scene
    qp.yields_from = at
    if scene.pairs == 0:
        return at
    for k in range(CLEARANCES):
        row = qp.C[at + k]
        for j in range(n + 1):
            row[j] = 0.0
        qp.l[at + k], qp.u[at + k] = -inf, inf
        if scene.slot[k] >= 0:
            qp.l[at + k] = scene.least[k]
            for j in range(n):
                row[j] = scene.G[k, j]
    return at + CLEARANCES
