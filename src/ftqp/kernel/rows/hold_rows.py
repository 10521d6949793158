"""Further tasks that go before that of the tip, as equality rows of the QP."""

from math import inf
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.side_by_side import WIDTH, put, several
from ftqp.kernel.rows.further_tasks import term_rows


@jit
def fill(K: Any, at: int) -> int:
    """J x = b of every task that goes before the tip's, from row ``at`` of C on; the next free row.

    One whose weight is 0 keeps its rows, which ask for nothing. Where box and rows exclude each other the
    rows give way, as torque limits do.
    Source: docs/theory/further-tasks.md, "Before the task of the tip".
    """
    terms, qp, n = K.terms, K.qp, K.chain.n
    for t in range(terms.count):
        if terms.hard[t] == 0:
            continue
        term_rows(K, t)
        for k in range(6):
            if terms.rows[t] & (1 << k) == 0:
                continue
            row, rows = qp.C[at], terms.J[t, k]
            for at_joint in range(0, n, WIDTH):
                put(row, at_joint, several(rows, at_joint))
            row[n] = 0.0
            qp.l[at] = qp.u[at] = terms.asked[t, k]
            if terms.weight[t] == 0.0:
                qp.l[at], qp.u[at] = -inf, inf
            at += 1
    return at
