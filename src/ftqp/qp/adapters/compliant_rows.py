"""Equality rows that give way for a price, as the slacks of a planner's QP make them."""

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.qp.adapters.buffers import QPBuffers


def compliance(qp: QPBuffers) -> FloatArray | None:
    """How soft each equality row is, soft_k = c_k^2 / h_k, (m,); None where rows have no slacks.

    The last m variables t are slacks where each is in one row alone, A x + c t = b, costs h t^2 / 2 and
    nothing else, and has no bounds. Minimised over t, this is |A x - b|^2 / (2 soft): the multiplier of a row
    is what is left of it over soft, and grows without measure where no x within the bounds comes near b.
    """
    n, m = qp.n, qp.m
    inner = n - m
    if m == 0 or inner <= 0:
        return None
    columns, costs = qp.A[:, inner:], qp.H[inner:]
    c, h = columns.diagonal(), costs[:, inner:].diagonal()
    if (
        np.count_nonzero(columns) != m
        or np.count_nonzero(costs) != m
        or not (c != 0.0).all()
        or not (h > 0.0).all()
        or qp.g[inner:].any()
        or qp.C[:, inner:].any()
        or np.isfinite(qp.lb[inner:]).any()
        or np.isfinite(qp.ub[inner:]).any()
    ):
        return None
    return np.asarray(c * c / h)
